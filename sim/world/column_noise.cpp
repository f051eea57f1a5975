#include "sim/world/column_noise.hpp"

#include <Eigen/Cholesky>
#include <vector>

#include "core/signal/lock_in.hpp"

namespace tricoil::sim {
namespace {

using Covariance = Eigen::Matrix<double, 2 * kSourceCoils, 2 * kSourceCoils>;

/// Sum over the window's samples of r r^T; r: phasors of a unit impulse at the sample.
Covariance impulse_covariance(const signal::AcquisitionPlan& plan) {
    constexpr std::int32_t kImpulse = 1 << 20;  // a sample is an integer
    const auto carriers = static_cast<std::size_t>(plan.carriers());
    const auto size = static_cast<std::size_t>(plan.window_samples);
    std::array<signal::Oscillator<double>, kSourceCoils> oscillators;
    for (std::size_t j = 0; j < carriers; ++j) {
        oscillators[j] = signal::Oscillator<double>(plan.window_cycles[j], plan.window_samples);
    }
    std::vector<Sample> window(size);
    std::array<std::complex<double>, kSourceCoils> rotation{1, 1, 1};  // exp(-i w n)
    Covariance sum = Covariance::Zero();
    for (std::size_t n = 0; n < size; ++n) {
        window[n][0] = kImpulse;
        std::array<signal::ChannelPhasors<double>, kSourceCoils> phasors{};
        for (std::size_t j = 0; j < carriers; ++j) {
            phasors[j][0] = 2.0 / static_cast<double>(size) * kImpulse * rotation[j];
            rotation[j] *= oscillators[j].step();
        }
        const auto step =
            signal::hum_step<double>(std::span(oscillators).first(carriers), std::span(phasors).first(carriers), window);
        Eigen::Matrix<double, 2 * kSourceCoils, 1> response = Eigen::Matrix<double, 2 * kSourceCoils, 1>::Zero();
        for (std::size_t j = 0; j < carriers; ++j) {
            const std::complex<double> phasor = phasors[j][0] - signal::hum_leakage(oscillators[j], step, size)[0];
            response(static_cast<Eigen::Index>(2 * j)) = phasor.real() / kImpulse;
            response(static_cast<Eigen::Index>(2 * j + 1)) = phasor.imag() / kImpulse;
        }
        sum += response * response.transpose();
        window[n][0] = 0;
    }
    return sum;
}

}  // namespace

ColumnNoise::ColumnNoise(const signal::AcquisitionPlan& plan) : parts_(2 * plan.carriers()), factor_(Covariance::Zero()) {
    const Covariance covariance = impulse_covariance(plan);
    factor_.topLeftCorner(parts_, parts_) =
        Eigen::LLT<Eigen::MatrixXd>(covariance.topLeftCorner(parts_, parts_)).matrixL().toDenseMatrix();
}

ColumnNoise::Phasors ColumnNoise::draw(std::mt19937_64& random) {
    Parts white = Parts::Zero();
    for (int n = 0; n < parts_; ++n) {
        white(n) = normal_(random);
    }
    const Parts parts = factor_ * white;
    return {std::complex(parts(0), parts(1)), std::complex(parts(2), parts(3)), std::complex(parts(4), parts(5))};
}

}  // namespace tricoil::sim
