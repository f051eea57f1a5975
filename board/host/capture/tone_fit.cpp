#include "board/host/capture/tone_fit.hpp"

#include <algorithm>
#include <cmath>

#include "sim/dense_algebra.hpp"

namespace tricoil::host {

ToneFit::ToneFit(const std::vector<double>& w, std::size_t samples) : basis_(samples, 1 + 2 * w.size()) {
    basis_.col(0).setOnes();
    for (std::size_t k = 0; k < w.size(); ++k) {
        const auto column = static_cast<Index>(1 + 2 * k);
        const Eigen::ArrayXd phase = w[k] * Eigen::ArrayXd::LinSpaced(basis_.rows(), 0, static_cast<double>(samples - 1));
        basis_.col(column) = phase.cos();
        basis_.col(column + 1) = phase.sin();
    }
    inverse_ = inverse_of_definite(basis_.transpose() * basis_);
}

Tones ToneFit::fit(std::span<const double> values, std::size_t channels) const {
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Rows> samples(values.data(), basis_.rows(), static_cast<Index>(channels));
    const Eigen::MatrixXd found = inverse_ * (basis_.transpose() * samples);
    Tones tones;
    tones.amplitude.resize(samples.cols(), basis_.cols() / 2);
    for (Index k = 0; k < tones.amplitude.cols(); ++k) {
        tones.amplitude.col(k).real() = found.row(1 + 2 * k).transpose();
        tones.amplitude.col(k).imag() = -found.row(2 + 2 * k).transpose();
    }
    const auto freedom = static_cast<double>(std::max<Index>(basis_.rows() - basis_.cols(), 1));
    tones.noise = ((samples - basis_ * found).colwise().squaredNorm() / freedom).cwiseSqrt().transpose();
    return tones;
}

}  // namespace tricoil::host
