// Kalman filter that splits the high band's pose into the sensor's motion and a bias. Three axes with one covariance.
#pragma once

#include <algorithm>
#include <array>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Both parts are double-integrated white noise. The high band measures their sum on every row, almost without noise. The low
/// band measures the mean bias over the last two lines, once a line. Between two lines the filter separates the parts by their
/// process noises, which are estimated from second differences of the low band's results.
struct SplitParams {
    double decay = 0.1;       // weight of a new estimate, once a line, if it is smaller than the present process noise
    double attack = 0.4;      // weight if it is larger
    double min_noise = 1e-8;  // smallest process noise, unit^2/s^3: 3 um after 0.13 s
};

class SplitFilter {
public:
    using Vector = Vec3<double>;

    SplitFilter() = default;
    SplitFilter(const SplitParams& params, double row_period_s, int rows_per_line)
        : attack_(params.attack),
          decay_(params.decay),
          min_noise_(params.min_noise),
          period_s_(row_period_s),
          row_share_(1.0 / rows_per_line),
          line_s_(row_period_s * rows_per_line),
          motion_noise_(min_noise_),
          bias_noise_(min_noise_) {}

    /// Before the first row. Standard deviations: of the bias, and of both rates (unit/s).
    void start(const Vector& sum, double bias_sigma, double rate_sigma) {
        means_.setZero();
        means_.row(kSum) = sum.transpose();
        covariance_.setZero();
        covariance_(kBias, kBias) = bias_sigma * bias_sigma;
        covariance_(kSumRate, kSumRate) = covariance_(kBiasRate, kBiasRate) = rate_sigma * rate_sigma;
    }

    /// One row: prediction, then the measured sum.
    void add_row(const Vector& sum, double variance) {
        predict();
        States h = States::Zero();
        h(kSum) = 1;
        correct(h, sum, variance);
    }

    /// One row without a measurement.
    void skip_row() { predict(); }

    /// At the end of a line, if the last two lines were complete: means of the bands' disagreement and of the sum over both. The
    /// bias is `stretch` times the disagreement. variance: of the disagreement.
    void add_means(const Vector& disagreement, const Vector& sum, double stretch, double variance) {
        const Vector bias = stretch * disagreement;
        variance *= stretch * stretch;
        estimate_noise(disagreement, sum, stretch, variance);
        States h = States::Zero();
        h(kThisLine) = h(kLastLine) = 0.5;
        correct(h, bias, variance);
    }

    /// At the end of every line, after add_means().
    void next_line() {
        means_.row(kLastLine) = means_.row(kThisLine);
        means_.row(kThisLine).setZero();
        covariance_.row(kLastLine) = covariance_.row(kThisLine);
        covariance_.col(kLastLine) = covariance_.col(kThisLine);
        covariance_.row(kThisLine).setZero();
        covariance_.col(kThisLine).setZero();
    }

    [[nodiscard]] Vector sum() const { return means_.row(kSum).transpose(); }
    [[nodiscard]] Vector bias() const { return means_.row(kBias).transpose(); }
    /// Variance of the motion per axis. The variance of the bias is equal, except for the high band's noise.
    [[nodiscard]] double variance() const {
        const double v = covariance_(kSum, kSum) - 2 * covariance_(kSum, kBias) + covariance_(kBias, kBias);
        return std::max(v, 0.0);
    }

private:
    // The sum, not the motion, is a state: its variance is small by itself, not as a difference of large ones.
    // kThisLine, kLastLine: mean bias during that line.
    enum State : int { kSum, kSumRate, kBias, kBiasRate, kThisLine, kLastLine, kStates };
    using States = Matrix<double, kStates, 1>;
    using Covariance = Matrix<double, kStates, kStates>;

    /// Variance of second differences of means over two lines, per process noise and line period cubed: the integral of the
    /// squared second difference of a ramp's means.
    static constexpr double kSecondDifference = 0.3833;

    void predict() {
        const double dt = period_s_;
        Covariance f = Covariance::Identity();
        f(kSum, kSumRate) = f(kBias, kBiasRate) = dt;
        f(kThisLine, kBias) = row_share_;
        f(kThisLine, kBiasRate) = row_share_ * dt;
        means_ = f * means_;
        covariance_ = f * covariance_ * f.transpose();
        const double both = motion_noise_ + bias_noise_;
        add_noise(kSum, kSum, both);
        add_noise(kBias, kBias, bias_noise_);
        add_noise(kSum, kBias, bias_noise_);
        add_noise(kBias, kSum, bias_noise_);
    }

    /// Integrated white noise of one row, in the block of (value, rate) at (i, j).
    void add_noise(int i, int j, double q) {
        const double dt = period_s_;
        covariance_(i, j) += q * dt * dt * dt / 3;
        covariance_(i, j + 1) += q * dt * dt / 2;
        covariance_(i + 1, j) += q * dt * dt / 2;
        covariance_(i + 1, j + 1) += q * dt;
    }

    void correct(const States& h, const Vector& measured, double variance) {
        const States ph = covariance_ * h;
        const double innovation = h.dot(ph) + variance;
        if (!(innovation > 0)) {
            return;
        }
        const States gain = ph / innovation;
        means_ += gain * (measured.transpose() - h.transpose() * means_);
        covariance_ -= gain * ph.transpose();
        for (int i = 0; i < kStates; ++i) {  // rounding
            covariance_(i, i) = std::max(covariance_(i, i), 0.0);
        }
    }

    /// All differences use the present `stretch`, so that a change of the scalar does not appear as motion.
    void estimate_noise(const Vector& disagreement, const Vector& sum, double stretch, double variance) {
        if (known_lines_ >= 2) {
            const Vector bias = stretch * (disagreement - 2 * disagreements_[1] + disagreements_[0]);
            follow(bias_noise_, bias, variance);
            follow(motion_noise_, sum - 2 * sums_[1] + sums_[0] - bias, variance);
        }
        known_lines_ = std::min(known_lines_ + 1, 2);
        disagreements_ = {disagreements_[1], disagreement};
        sums_ = {sums_[1], sum};
    }

    void follow(double& noise, const Vector& second_difference, double variance) const {
        const double power = std::max(second_difference.squaredNorm() / 3 - 6 * variance, 0.0);
        const double seen = power / (kSecondDifference * line_s_ * line_s_ * line_s_);
        noise = std::max(noise + (seen > noise ? attack_ : decay_) * (seen - noise), min_noise_);
    }

    double attack_ = 0;
    double decay_ = 0;
    double min_noise_ = 0;
    double period_s_ = 0;
    double row_share_ = 0;
    double line_s_ = 0;
    double motion_noise_ = 0;  // unit^2/s^3
    double bias_noise_ = 0;
    Matrix<double, kStates, 3> means_ = Matrix<double, kStates, 3>::Zero();
    Covariance covariance_ = Covariance::Zero();
    int known_lines_ = 0;
    std::array<Vector, 2> disagreements_{Vector::Zero(), Vector::Zero()};  // of the last two lines, the older first
    std::array<Vector, 2> sums_{Vector::Zero(), Vector::Zero()};
};

}  // namespace tricoil::host
