// The analog world of the board: three source coils with their power stages, a moving sensor, preamplifiers.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "sim/virtual_board/coils/board_circuit.hpp"
#include "sim/virtual_board/coils/eddy_response.hpp"
#include "sim/virtual_board/coils/low_pass.hpp"
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
    CoilBench(const sim::Scenario& scenario, const BoardCircuit& circuit)
        : scenario_(scenario),
          circuit_(circuit),
          world_(world_of(scenario.world, circuit), *scenario.motion, scenario.faults),
          coils_{DrivenCoil(circuit.stages[0]), DrivenCoil(circuit.stages[1]), DrivenCoil(circuit.stages[2])} {
        metal_.set = sim::CoilWorld::metal_of(scenario.faults);
        metal_.set.tune(EddyResponse::tones_hz());
        update_coupling(0);
    }

    /// Outputs of the board from now on: voltage relative to half the supply, and the state of the enable line.
    void drive(int coil, double volts, bool on) {
        drive_v_[static_cast<std::size_t>(coil)] = volts;
        on_[static_cast<std::size_t>(coil)] = on;
    }
    void heartbeat(double time_s) { heartbeat_s_ = time_s; }

    /// Advances to `time_s`; earlier times have no effect.
    void advance(double time_s) {
        const double step_s = time_s - now_s_;
        if (step_s <= 0) {
            return;
        }
        now_s_ = time_s;
        for (int j = 0; j < kSourceCoils; ++j) {
            const bool driven = is_driven(j);
            last_driven_s_ = driven ? time_s : last_driven_s_;
            DrivenCoil& coil = coils_[static_cast<std::size_t>(j)];
            const double before = coil.derivative();
            coil.advance(drive_v_[static_cast<std::size_t>(j)], driven, step_s);
            if (!metal_.set.empty()) {
                metal_.loops[static_cast<std::size_t>(j)].advance(step_s, before, coil.derivative(), coil.current());
            }
        }
        update_coupling(time_s);
        hum_v_ = hum_v(std::sin(kTurn * scenario_.world.mains_hz * time_s));
    }

    /// Signals at the current time before the low-pass filters of preamplifier and reference amplifier, relative to half the
    /// supply. The voltage of a sensor coil is the sum of d/dt flux_vs() and sensor_v(), which contains hum and metal.
    [[nodiscard]] double flux_vs(int coil) const {
        double flux = 0;
        for (int j = 0; j < kSourceCoils; ++j) {
            flux += coupling_(coil, j) * coils_[static_cast<std::size_t>(j)].current() * effect_.current(j);
        }
        return sensor_gain(coil) * flux / kReferenceRadS;
    }
    [[nodiscard]] double sensor_v(int coil) const {
        return (metal_.is_active ? sensor_gain(coil) * metal_v(coil) / kReferenceRadS : 0) + hum_v_;
    }
    [[nodiscard]] double reference_v() const {
        double sum = 0;
        for (int j = 0; j < kSourceCoils; ++j) {
            sum += circuit_.sense_ohm[static_cast<std::size_t>(j)] * coils_[static_cast<std::size_t>(j)].current() *
                   effect_.current(j);
        }
        return circuit_.channels[kReferenceChannel].gain * sum;
    }
    /// Couplings that exact converters would measure at a pose with a carrier at `hz`, without faults, as the firmware defines
    /// them: relative to the reference, of a channel with unity response at 10 kHz.
    [[nodiscard]] Mat3<double> coupling(const sim::Pose& pose, double hz) const {
        const AnalogChannel& reference = circuit_.channels[kReferenceChannel];
        Mat3<double> x = world_.coupling(pose);
        for (int j = 0; j < kSourceCoils; ++j) {
            x.col(j) /= reference.gain * circuit_.sense_ohm[static_cast<std::size_t>(j)];
        }
        for (int i = 0; i < kSensorCoils; ++i) {
            const double corner_hz = circuit_.channels[static_cast<std::size_t>(i)].corner_hz;
            x.row(i) *= sensor_gain(i) * LowPass::response(hz, corner_hz) / LowPass::response(hz, reference.corner_hz);
        }
        return x;
    }
    /// The channel's converter repeats one code.
    [[nodiscard]] bool is_stuck(int channel) const { return effect_.stuck[static_cast<std::size_t>(channel)]; }

    /// True if both the stage's enable and the hardware enable are on.
    [[nodiscard]] bool is_driven(int coil) const {
        return on_[static_cast<std::size_t>(coil)] && heartbeat_s_ >= 0 && now_s_ - heartbeat_s_ <= kHeartbeatHoldS;
    }
    [[nodiscard]] bool any_driven() const { return is_driven(0) || is_driven(1) || is_driven(2); }
    /// Time at which a stage was last on; for deadlines.
    [[nodiscard]] double last_driven_s() const { return last_driven_s_; }

private:
    static constexpr double kTurn = 2 * std::numbers::pi;
    static constexpr double kReferenceRadS = kTurn * 10e3;  // frequency at which couplings are defined, as in CoilWorld
    static constexpr double kMetalKnotS = 1e-3;             // for 1 m/s at 50 mm from an object the error is 3e-4 of its field
    // Linear interpolation over this time: error 1e-6 of the amplitude for a 10 Hz oscillation.
    static constexpr double kKnotS = 32e-6;
    static constexpr double kVacuum = 4e-7 * std::numbers::pi;  // permeability, V s / (A m)
    static constexpr double kUnit_m2 = 0.1;                     // of the matrices that contain the areas of the coils
    /// The scenario's world with the coils of the board: couplings in volts at a sensor coil per ampere, at 10 kHz.
    static sim::WorldParams world_of(const sim::WorldParams& scenario, const BoardCircuit& circuit) {
        sim::WorldParams world = scenario;
        world.coupling_constant_m3 = kVacuum / (2 * std::numbers::pi) * kReferenceRadS * kUnit_m2 * kUnit_m2;
        world.sensor_matrix = circuit.sensor_axes * world.sensor_matrix;
        world.pick_up = circuit.pick_up;
        for (int c = 0; c < 3; ++c) {
            world.source_matrix.col(c) *= circuit.source_m2[static_cast<std::size_t>(c)] / kUnit_m2;
            world.sensor_matrix.row(c) *= circuit.sensor_m2[static_cast<std::size_t>(c)] / kUnit_m2;
        }
        return world;
    }

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

    void update_coupling(double time_s) {
        if (knot_s_ < 0 || time_s >= knot_s_ + kKnotS) {
            const double first = std::floor(time_s / kKnotS) * kKnotS;
            effect_ = sim::effect_at(scenario_.faults, time_s);
            const auto at = [&](double t) { return world_.coupling(scenario_.motion->at(t), effect_); };
            const bool follows = knot_s_ >= 0 && std::abs(first - knot_s_ - kKnotS) < 1e-9;
            knots_[0] = follows ? knots_[1] : at(first);
            knots_[1] = at(first + kKnotS);
            knot_s_ = first;
        }
        coupling_ = knots_[0] + (time_s - knot_s_) / kKnotS * (knots_[1] - knots_[0]);
        update_metal(time_s);
    }
    void update_metal(double time_s) {
        metal_.is_active = metal_.set.acts_at(time_s);
        if (!metal_.is_active) {
            metal_.knot_s = -1;
            return;
        }
        if (metal_.knot_s < 0 || time_s >= metal_.knot_s + kMetalKnotS) {
            const double first = std::floor(time_s / kMetalKnotS) * kMetalKnotS;
            const bool follows = metal_.knot_s >= 0 && std::abs(first - metal_.knot_s - kMetalKnotS) < 1e-9;
            metal_.knots[0] = follows ? metal_.knots[1] : metal_terms(first);
            metal_.knots[1] = metal_terms(first + kMetalKnotS);
            metal_.knot_s = first;
            for (std::size_t p = 0; p < EddyResponse::kTerms; ++p) {
                metal_.rates[p] = (metal_.knots[1][p] - metal_.knots[0][p]) / kMetalKnotS;
            }
        }
        for (std::size_t p = 0; p < EddyResponse::kTerms; ++p) {
            metal_.couplings[p] = metal_.knots[0][p] + (time_s - metal_.knot_s) * metal_.rates[p];
        }
    }
    [[nodiscard]] EddyResponse::Terms metal_terms(double time_s) {
        const sim::Pose pose = scenario_.motion->at(time_s);
        EddyResponse::Terms terms = metal_.response.fit(metal_.set.field(pose.position_m, time_s, now_s_));
        for (Mat3<double>& term : terms) {
            term = world_.sensor_side(pose, effect_) * term * world_.source_side(effect_);
        }
        return terms;
    }
    /// Voltage induced by the metal's field, times the reference angular frequency.
    [[nodiscard]] double metal_v(int coil) const {
        double induced = 0;
        for (int j = 0; j < kSourceCoils; ++j) {
            const LoopCurrents& loops = metal_.loops[static_cast<std::size_t>(j)];
            for (std::size_t p = 0; p < EddyResponse::kTerms; ++p) {
                induced +=
                    (metal_.couplings[p](coil, j) * loops.derivatives()[p] + metal_.rates[p](coil, j) * loops.currents()[p]) *
                    effect_.current(j);
            }
        }
        return induced;
    }
    /// Mains interference as in CoilWorld: the fundamental, the third harmonic with 1/3 and the fifth harmonic with 1/5 of its
    /// amplitude (multiple-angle formulas); plus an overload at the mains frequency.
    [[nodiscard]] double hum_v(double sine) const {
        const double squared = sine * sine;
        const double third = sine * (3 - 4 * squared);
        const double fifth = sine * (5 - 20 * squared + 16 * squared * squared);
        return scenario_.world.mains_v * (sine + third / 3 + fifth / 5) + effect_.overload_ranges * kHalfSupplyV * sine;
    }
    [[nodiscard]] double sensor_gain(int coil) const {
        const auto c = static_cast<std::size_t>(coil);
        return circuit_.channels[c].gain * scenario_.world.channel_gain[c];
    }

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
