// Estimates the scalar that extrapolates couplings of two bands to zero metal.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Couplings without metal = low - scalar (high - low). The scalar is share / (1 - share), where share is the effect of the metal
/// in the low band relative to the high band.
///
/// Two sources. If the sensor rests, the low band's pose moves by scalar times the disagreement of the bands. If it moves, only
/// the three redundant directions of the couplings do not depend on motion: there the low band changes by share times the high
/// band. Each source is weighted by the noise of its own residuals, so motion makes the first one weak by itself.
class BandScalar {
public:
    static constexpr double kPriorSigma = 1;
    static constexpr double kMin = -0.2;
    static constexpr double kMax = 5;  // share 0.83: beyond this the bands are too similar to extrapolate

    BandScalar() = default;
    explicit BandScalar(std::optional<double> fixed) : fixed_(fixed.has_value()) {
        if (fixed_) {
            value_ = *fixed;
            variance_ = 0;
        }
    }

    [[nodiscard]] double value() const { return value_; }
    [[nodiscard]] double sigma() const { return std::sqrt(variance_); }
    [[nodiscard]] double share() const { return value_ / (1 + value_); }

    /// Change of the low band's position (m) and of the bands' disagreement (high - low) from one line to the next. `variance`:
    /// of the low band's position per axis. A disagreement within its noise is ignored, because both arguments contain the noise
    /// of the low band.
    void add_poses(const Vec3<double>& low, const Vec3<double>& disagreement, double variance) {
        if (!fixed_ && disagreement.squaredNorm() > kClear * variance) {
            correct(Vec3<double>(low - value_ * disagreement), disagreement, variance, pose_noise_);
        }
    }

    /// Changes of the redundant part of the couplings, both in units of the low band. `variance`: of one low coupling; changes
    /// within it are ignored, because slow drift is equal in both bands. `misfit`: variance by which motion changes the misfit of
    /// the calibration, also equal in both bands.
    template <int N>
    void add_redundant(const Matrix<double, N, 1>& low, const Matrix<double, N, 1>& high, double variance, double misfit) {
        const double slope = 1 / ((1 + value_) * (1 + value_));  // d share / d scalar
        if (!fixed_ && high.squaredNorm() > kSeen * variance) {
            correct<N>(low - share() * high, slope * high, variance + misfit, redundant_noise_);
        }
    }

private:
    static constexpr double kClear = 100;
    static constexpr double kSeen = 4;

    /// noise: running variance of the residuals. A residual far above it gets less weight.
    template <int N>
    void correct(const Matrix<double, N, 1>& residual, const Matrix<double, N, 1>& slope, double min_variance, double& noise) {
        const double size = residual.squaredNorm() / 3;
        const double used = std::max({noise, size / 2, min_variance});
        const double information = slope.squaredNorm() / used;
        variance_ /= 1 + variance_ * information;
        value_ = std::clamp(value_ + variance_ * slope.dot(residual) / used, kMin, kMax);
        noise += 0.2 * (size - noise);
    }

    bool fixed_ = false;
    double value_ = 0;
    double variance_ = kPriorSigma * kPriorSigma;
    double pose_noise_ = 0;       // m^2
    double redundant_noise_ = 0;  // low coupling units squared
};

}  // namespace tricoil::host
