#include "sim/motion/zero_phase_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tricoil::sim {
namespace {

struct Biquad {
    double b0, b1, b2, a1, a2;
};

/// Bilinear transform of 1 / (s^2 + sqrt(2) s + 1) with a prewarped cutoff.
Biquad butterworth(double cutoff) {
    const double k = std::tan(std::numbers::pi * cutoff);
    const double norm = 1 / (1 + std::numbers::sqrt2 * k + k * k);
    return {k * k * norm, 2 * k * k * norm, k * k * norm, 2 * (k * k - 1) * norm, (1 - std::numbers::sqrt2 * k + k * k) * norm};
}

/// Filters in place; the initial filter state is the steady state of the first row.
void run_forwards(const Biquad& f, Eigen::MatrixXd& rows) {
    Eigen::RowVectorXd x1 = rows.row(0);
    Eigen::RowVectorXd x2 = x1;
    Eigen::RowVectorXd y1 = x1;
    Eigen::RowVectorXd y2 = x1;
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const Eigen::RowVectorXd x = rows.row(i);
        const Eigen::RowVectorXd y = f.b0 * x + f.b1 * x1 + f.b2 * x2 - f.a1 * y1 - f.a2 * y2;
        rows.row(i) = y;
        x2 = x1;
        x1 = x;
        y2 = y1;
        y1 = y;
    }
}

}  // namespace

Eigen::MatrixXd zero_phase_low_pass(const Eigen::MatrixXd& samples, double cutoff) {
    const Biquad filter = butterworth(cutoff);
    const Eigen::Index n = samples.rows();
    const auto settle = static_cast<Eigen::Index>(std::ceil(3 / cutoff));
    const Eigen::Index pad = std::min(n - 1, settle);
    Eigen::MatrixXd padded(n + 2 * pad, samples.cols());
    for (Eigen::Index i = 0; i < pad; ++i) {
        padded.row(i) = 2 * samples.row(0) - samples.row(pad - i);
        padded.row(n + pad + i) = 2 * samples.row(n - 1) - samples.row(n - 2 - i);
    }
    padded.middleRows(pad, n) = samples;

    run_forwards(filter, padded);
    padded = padded.colwise().reverse().eval();
    run_forwards(filter, padded);
    padded = padded.colwise().reverse().eval();
    return padded.middleRows(pad, n);
}

}  // namespace tricoil::sim
