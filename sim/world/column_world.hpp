// Simulation of columns without samples, for many runs.
#pragma once

#include "sim/world/coil_world.hpp"
#include "sim/world/column_noise.hpp"

namespace tricoil::sim {

/// Computes the columns that the demodulator gives for the samples of a CoilWorld: couplings averaged over the window, noise of
/// the sensor and reference channels, quadrature due to motion of the sensor, flags. Left out:
/// mains hum, switching transients, motion of metal within a window, and leakage between carriers due to curvature.
class ColumnWorld {
public:
    /// `world` must be configured and outlive this object. Throws std::invalid_argument for a fault that acts on samples: a stuck
    /// channel, an overload, a broken stage.
    ColumnWorld(CoilWorld& world, const std::vector<Fault>& faults);

    struct Block {
        Excitation state = Excitation::off;
        double start_s = 0;  // of the simulation
        DeviceTime start{};  // the same instant
        std::uint32_t sequence = 0;
    };

    /// Replaces `columns` by those of a block. False if a fault drops it.
    bool simulate(const Block& block, signal::Columns<double>& columns);

private:
    struct WindowCoupling {
        CurrentColumns mean;  // over the window
        Mat3<double> rate;    // without metal, 1/s
    };
    using ChannelNoise = std::array<ColumnNoise::Phasors, kChannels>;

    void advance(double start_s);
    [[nodiscard]] WindowCoupling window_coupling(const FaultEffect& effect, double start_s);
    void find_motion_lags();
    [[nodiscard]] double carrier_rad_s(std::size_t carrier) const;
    [[nodiscard]] MeasuredColumn<double> make_column(const Block& block, int carrier_index, const WindowCoupling& coupling,
                                                     const FaultEffect& effect, const ChannelNoise& noise) const;
    [[nodiscard]] bool saturates(const Block& block, const CurrentColumns& coupling, const FaultEffect& effect) const;

    CoilWorld& world_;
    signal::AcquisitionPlan plan_;
    signal::DemodulatorParams<double> demodulator_;
    ColumnNoise noise_;
    double sample_sigma_v_;
    double middle_s_;                                               // of the window, after the start of its block
    std::array<std::complex<double>, kMaxCarriers> current_phase_;  // of the carriers' phasors; the currents peak in the middle
    Eigen::Matrix<double, kMaxCarriers, kMaxCarriers>
        motion_lag_s_;           // (j, i): quadrature of current i over the rate of current j
    std::array<Pose, 3> poses_;  // at the middle of the previous, present and next window
    double present_s_ = -1;      // start of the present block
    std::mt19937_64 random_;
    std::mt19937_64 drop_random_;
};

}  // namespace tricoil::sim
