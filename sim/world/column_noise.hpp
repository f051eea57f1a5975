// Noise of the demodulator's phasors, from noise of the samples.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <random>

#include "core/signal/acquisition_plan.hpp"

namespace tricoil::sim {

/// Draws the errors of one channel's carrier phasors for samples with white noise. Their covariance is exact: lock-in and removal
/// of hum are linear in the samples, so it follows from their responses to unit impulses.
class ColumnNoise {
public:
    explicit ColumnNoise(const signal::AcquisitionPlan& plan);

    using Phasors = std::array<std::complex<double>, kMaxCarriers>;

    /// Errors of all carriers of one channel, for samples with a standard deviation of 1. Zero for carriers that the plan does
    /// not use.
    Phasors draw(std::mt19937_64& random);

private:
    using Parts = Eigen::Matrix<double, 2 * kMaxCarriers, 1>;  // real and imaginary part of each carrier
    int parts_;
    Eigen::Matrix<double, 2 * kMaxCarriers, 2 * kMaxCarriers> factor_;  // lower triangle; times its transpose: the covariance
    std::normal_distribution<double> normal_{0, 1};
};

}  // namespace tricoil::sim
