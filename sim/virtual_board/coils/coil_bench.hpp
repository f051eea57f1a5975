// The analog world of the board: three source coils with their power stages, a moving sensor, preamplifiers.
#pragma once

#include <array>

#include "sim/virtual_board/coils/board_circuit.hpp"
#include "sim/virtual_board/coils/eddy_response.hpp"
#include "sim/world/scenario.hpp"

namespace tricoil::virtual_board {

/// The currents depend only on the board's outputs, so that a wrong excitation gives wrong signals. Field, motion and faults are
/// those of the scenario's world.
class CoilBench {
public:
    static constexpr double kSupplyV = 3.3;
    static constexpr double kHalfSupplyV = kSupplyV / 2;
    /// The enable of the power stages drops this long after the last heartbeat edge: 47 kohm and 1 uF at the monostable.
    static constexpr double kHeartbeatHoldS = 47e-3;

    /// From the scenario's world only motion, faults, mains and the matrices of gains and angles are used; both must outlive the
    /// bench.
    CoilBench(const sim::Scenario& scenario, const BoardCircuit& circuit);

    /// Outputs of the board from now on: voltage relative to half the supply, and the state of the enable line.
    void drive(int coil, double volts, bool on);
    void heartbeat(double time_s) { heartbeat_s_ = time_s; }

    /// Advances to `time_s`; earlier times have no effect.
    void advance(double time_s);

    /// Signals at the current time before the low-pass filters of preamplifier and reference amplifier, relative to half the
    /// supply. The voltage of a sensor coil is the sum of d/dt flux_vs() and sensor_v(), which contains hum and metal.
    [[nodiscard]] double flux_vs(int coil) const;
    [[nodiscard]] double sensor_v(int coil) const;
    [[nodiscard]] double reference_v() const;
    /// Couplings that exact converters would measure at a pose with a carrier at `hz`, without faults, as the firmware defines
    /// them: relative to the reference, of a channel with unity response at 10 kHz.
    [[nodiscard]] Mat3<double> coupling(const sim::Pose& pose, double hz) const;
    /// The channel's converter repeats one code.
    [[nodiscard]] bool is_stuck(int channel) const { return effect_.stuck[static_cast<std::size_t>(channel)]; }

    /// True if both the stage's enable and the hardware enable are on.
    [[nodiscard]] bool is_driven(int coil) const;
    [[nodiscard]] bool any_driven() const { return is_driven(0) || is_driven(1) || is_driven(2); }
    /// Time at which a stage was last on; for deadlines.
    [[nodiscard]] double last_driven_s() const { return last_driven_s_; }

private:
    /// Couplings that metal adds, per R-L loop of the response.
    struct Metal {
        sim::MetalSet set;
        EddyResponse response;
        std::array<LoopCurrents, kSourceCoils> loops;
        double knot_s = -1;
        std::array<EddyResponse::Terms, 2> knots;
        bool is_active = false;
        EddyResponse::Terms couplings;
        EddyResponse::Terms rates;
    };

    void update_coupling(double time_s);
    void update_metal(double time_s);
    [[nodiscard]] EddyResponse::Terms metal_terms(double time_s);
    [[nodiscard]] double metal_v(int coil) const;
    [[nodiscard]] double hum_v(double sine) const;
    [[nodiscard]] double sensor_gain(int coil) const;

    const sim::Scenario& scenario_;
    const BoardCircuit& circuit_;
    sim::CoilWorld world_;
    std::array<DrivenCoil, kSourceCoils> coils_;
    std::array<double, kSourceCoils> drive_v_{};
    std::array<bool, kSourceCoils> on_{};
    double now_s_ = 0;
    double heartbeat_s_ = -1;
    double last_driven_s_ = -1;
    double hum_v_ = 0;
    double knot_s_ = -1;  // couplings are known at this time and kKnotS later
    std::array<Mat3<double>, 2> knots_;
    Mat3<double> coupling_ = Mat3<double>::Zero();
    sim::FaultEffect effect_;
    Metal metal_;
};

}  // namespace tricoil::virtual_board
