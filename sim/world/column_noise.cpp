#include "sim/world/column_noise.hpp"

#include <vector>

#include "core/signal/lock_in.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::sim {
namespace {

using Covariance = Eigen::Matrix<double, 2 * kMaxCarriers, 2 * kMaxCarriers>;

/// Sum over the window's samples of r r^T; r: phasors of a unit impulse at the sample.
Covariance impulse_covariance(const signal::AcquisitionPlan& plan) {
    constexpr std::int32_t kImpulse = 1 << 20;  // a sample is an integer
    const auto carriers = static_cast<std::size_t>(plan.carriers());
    const auto size = static_cast<std::size_t>(plan.window_samples);
    std::array<signal::Oscillator<double>, kMaxCarriers> oscillators;
    for (std::size_t j = 0; j < carriers; ++j) {
        oscillators[j] = signal::Oscillator<double>(plan.window_cycles[j], plan.window_samples);
    }
    std::vector<Sample> window(size);
    std::array<std::complex<double>, kMaxCarriers> rotation;  // exp(-i w n)
    rotation.fill(1);
    Covariance sum = Covariance::Zero();
    for (std::size_t n = 0; n < size; ++n) {
        window[n][0] = kImpulse;
        std::array<signal::ChannelPhasors<double>, kMaxCarriers> phasors{};
        for (std::size_t j = 0; j < carriers; ++j) {
            phasors[j][0] = 2.0 / static_cast<double>(size) * kImpulse * rotation[j];
            rotation[j] *= oscillators[j].step();
        }
        const auto step =
            signal::hum_step<double>(std::span(oscillators).first(carriers), std::span(phasors).first(carriers), window);
        Eigen::Matrix<double, 2 * kMaxCarriers, 1> response = Eigen::Matrix<double, 2 * kMaxCarriers, 1>::Zero();
        for (std::size_t j = 0; j < carriers; ++j) {
            const bool is_high = j < kSourceCoils;  // the demodulator removes hum from the high band only
            const std::complex<double> hum = is_high ? signal::hum_leakage(oscillators[j], step, size)[0] : 0;
            const std::complex<double> phasor = phasors[j][0] - hum;
            response(static_cast<Index>(2 * j)) = phasor.real() / kImpulse;
            response(static_cast<Index>(2 * j + 1)) = phasor.imag() / kImpulse;
        }
        sum += response * response.transpose();
        window[n][0] = 0;
    }
    return sum;
}

}  // namespace

ColumnNoise::ColumnNoise(const signal::AcquisitionPlan& plan) : parts_(2 * plan.carriers()), factor_(Covariance::Zero()) {
    const Covariance covariance = impulse_covariance(plan);
    factor_.topLeftCorner(parts_, parts_) = lower_factor(covariance.topLeftCorner(parts_, parts_));
}

ColumnNoise::Phasors ColumnNoise::draw(std::mt19937_64& random) {
    Parts white = Parts::Zero();
    for (int n = 0; n < parts_; ++n) {
        white(n) = normal_(random);
    }
    const Parts parts = factor_ * white;
    Phasors phasors;
    for (std::size_t j = 0; j < phasors.size(); ++j) {
        const auto part = static_cast<Index>(2 * j);
        phasors[j] = {parts(part), parts(part + 1)};
    }
    return phasors;
}

}  // namespace tricoil::sim
