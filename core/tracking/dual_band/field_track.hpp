// Matrices that change at a slowly varying rate, from noisy measurements of their past.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/geometry/types.hpp"

namespace tricoil::tracking {

/// Kalman filter with one covariance for all entries. Its process noise follows the innovations.
template <std::size_t Count>
class FieldTrack {
public:
    using Matrices = std::array<Mat3<double>, Count>;

    /// unit: scale of the couplings. Everything is unknown, but smaller than it.
    void start(double unit) {
        *this = FieldTrack{};
        unit_square_ = unit * unit;
        variance_ = kFirstSigma * kFirstSigma * unit_square_;
        rate_variance_ = kFirstRate * kFirstRate * unit_square_;
        process_noise_ = kLeastNoise * unit_square_;
    }

    void predict(double dt) {
        for (std::size_t n = 0; n < Count; ++n) {
            value_[n] += dt * rate_[n];
        }
        variance_ += 2 * dt * covariance_ + dt * dt * rate_variance_ + process_noise_ * dt * dt * dt / 3;
        covariance_ += dt * rate_variance_ + process_noise_ * dt * dt / 2;
        rate_variance_ += process_noise_ * dt;
    }

    /// Value at an earlier time.
    [[nodiscard]] Mat3<double> before(std::size_t n, double age_s) const { return value_[n] - age_s * rate_[n]; }

    /// innovation: measured minus before(). variance: of the measurement.
    void correct(const Matrices& innovation, double age_s, double variance) {
        double seen = 0;
        for (const Mat3<double>& part : innovation) {
            seen += part.squaredNorm() / (9 * Count);
        }
        const auto expected = [&] {
            return variance_ - 2 * age_s * covariance_ + age_s * age_s * rate_variance_ +
                   process_noise_ * age_s * age_s * age_s / 3;
        };
        const double ratio = seen / (expected() + variance);
        consistency_ += kConsistencyGain * (std::min(ratio, kLargestRatio) - consistency_);
        // A change that the process noise does not explain: metal has appeared, or moves otherwise than before.
        const double step = std::clamp(kNoiseGain * (ratio - 1), -kNoiseGain, kLargestNoiseStep);
        process_noise_ = std::clamp(process_noise_ * std::exp(step), kLeastNoise * unit_square_, kMostNoise * unit_square_);
        if (ratio > kGate) {
            const double factor = (seen - variance) / expected();
            variance_ *= factor;
            covariance_ *= factor;
            rate_variance_ *= factor;
        }
        const double total = expected() + variance;
        const double on_value = variance_ - age_s * covariance_;
        const double on_rate = covariance_ - age_s * rate_variance_;
        const double gain = on_value / total;
        const double rate_gain = on_rate / total;
        for (std::size_t n = 0; n < Count; ++n) {
            value_[n] += gain * innovation[n];
            rate_[n] += rate_gain * innovation[n];
        }
        variance_ = std::max(variance_ - gain * on_value, 0.0);
        covariance_ -= gain * on_rate;
        rate_variance_ = std::max(rate_variance_ - rate_gain * on_rate, 0.0);
    }

    [[nodiscard]] const Mat3<double>& value(std::size_t n) const { return value_[n]; }
    [[nodiscard]] double variance() const { return variance_ * std::max(1.0, consistency_); }

private:
    // Relative to the unit.
    static constexpr double kFirstSigma = 0.3;
    static constexpr double kFirstRate = 1;      // 1/s
    static constexpr double kLeastNoise = 1e-8;  // process noise, 1/s^3: 1e-4 after 3 s
    static constexpr double kMostNoise = 1e3;
    static constexpr double kNoiseGain = 0.6;  // weight of one measurement in the logarithm of the process noise
    static constexpr double kLargestNoiseStep = 4;
    static constexpr double kGate = 3.1;  // mean squared innovation of 9 entries over its variance: exceeded once in 1,000
    static constexpr double kConsistencyGain = 0.2;
    static constexpr double kLargestRatio = 10;

    Matrices value_ = zero();
    Matrices rate_ = zero();
    double unit_square_ = 0;
    double variance_ = 0;    // of an entry
    double covariance_ = 0;  // with its rate
    double rate_variance_ = 0;
    double process_noise_ = 0;
    double consistency_ = 1;  // mean squared innovation over its variance

    static Matrices zero() {
        Matrices matrices;
        matrices.fill(Mat3<double>::Zero());
        return matrices;
    }
};

}  // namespace tricoil::tracking
