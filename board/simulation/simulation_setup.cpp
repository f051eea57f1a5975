#include "board/simulation/simulation_setup.hpp"

#include <fmt/format.h>

#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "board/support/tracker_choice.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/world/metal_check.hpp"

namespace tricoil::host {
namespace {

sim::Scenario make_scenario(const SimulationOptions& options) {
    sim::Scenario scenario = load_scenario(options.scenario, options.seed);
    refuse_if(!(options.speed > 0 && options.speed <= 100), "--speed {}: must be positive, at most 100", options.speed);
    if (!options.trajectory.empty()) {
        sim::RecordedMotionParams params;
        params.place_m = options.place_m;
        params.speed = options.speed;
        auto motion = std::make_unique<sim::RecordedMotion>(read_trajectory(options.trajectory), params);
        scenario.name = options.trajectory;
        // The path ends in full motion: a prediction beyond its end has no truth.
        scenario.duration_s = motion->duration_s() - to_seconds(prediction_of_option(options.tracker, options.predict_ahead_s));
        scenario.motion = std::move(motion);
    } else {
        refuse_if(options.place_m != SimulationOptions{}.place_m, "--place: no recorded path to place; add --trajectory FILE");
        scenario.motion = std::make_unique<sim::PacedMotion>(std::move(scenario.motion), options.speed);
    }
    if (options.no_noise) {
        scenario.world.converter.noise_v_per_sqrt_hz = 0;
        scenario.world.mains_v = 0;
    }
    scenario.duration_s = options.duration_s.value_or(scenario.duration_s);
    for (const std::string& text : options.faults) {
        const sim::Fault fault = parse_fault(text);
        refuse_if(fault.begin_s > 0 && fault.begin_s >= scenario.duration_s,
                  "fault '{}': begins at {} s, but the run ends at {} s", text, fault.begin_s, scenario.duration_s);
        scenario.faults.push_back(fault);
    }
    sim::check_metal(scenario);
    return scenario;
}

signal::AcquisitionPlan make_plan(const SimulationOptions& options) {
    const auto plan = signal::plan_acquisition(
        signal::default_acquisition(multiplexing_of_name(options.multiplexing), options.frame_rate_hz, options.sample_rate_hz));
    if (!plan.ok()) {
        throw InputError(fmt::format("--rate-hz {} with --mux {} and --sample-rate-hz {}: {}", options.frame_rate_hz,
                                     options.multiplexing, options.sample_rate_hz, plan.status().message()));
    }
    return *plan;
}

void refuse_bad(const Status& status) {
    if (!status.ok()) {
        throw InputError(std::string("tracker: ") + status.message());
    }
}

/// Method and parameters from the options.
tracking::MethodParams<double> make_method(const SimulationOptions& options, const signal::AcquisitionPlan& plan) {
    tracking::MethodParams<double> method = method_of_name(options.tracker);
    const bool is_filter = std::holds_alternative<tracking::ScaatParams<double>>(method);
    if (auto* bands = std::get_if<tracking::DualBandParams>(&method)) {
        refuse_if(!plan.has_low_band(), "--tracker dual-band: needs two bands; use --mux dual-band");
        tracking::set_frame(*bands, plan.block_s());
    }
    refuse_if(options.no_deskew && (is_filter || !plan.is_tdm()),
              "--no-deskew: only for --mux tdm with --tracker direct or previous");
    set_deskew(method, plan.is_tdm() && !options.no_deskew);
    tracking::PreviousParams previous;
    previous.passes = options.passes;
    refuse_bad(tracking::check(tracking::TrackerParams<double>{{}, previous}));
    if (auto* chosen = std::get_if<tracking::PreviousParams>(&method)) {
        chosen->passes = options.passes;
    } else if (options.passes != SimulationOptions{}.passes) {
        throw InputError("--passes: only with --tracker previous or fixed-previous");
    }
    if (const Microseconds ahead = prediction_of_option(options.tracker, options.predict_ahead_s); ahead.count() > 0) {
        set_prediction(method, ahead);
    }
    return method;
}

void refuse_short(const SimulationOptions& options, double duration_s, double block_s) {
    if (std::isfinite(duration_s) && duration_s >= block_s) {
        return;
    }
    refuse_if(options.trajectory.empty() || options.duration_s,
              "--duration must be a finite number of seconds, at least one block");
    throw InputError(fmt::format("{}: the path leaves less than one block at --speed {} with --predict {}; give smaller values",
                                 options.trajectory, options.speed, options.predict_ahead_s));
}

void refuse_bad_stations(const SimulationOptions& options) {
    refuse_if(options.stations < 1 || options.stations > tracking::kMaxSensors, "--stations {}: must be 1 to {}",
              options.stations, tracking::kMaxSensors);
    refuse_if(options.stations > 1 && is_by_columns(options),
              "--stations: not with --fidelity columns, which simulates one sensor; use --fidelity samples");
    refuse_if(options.stations > 1 && fixed_method(options.tracker),
              "--stations: not with --tracker fixed-direct or fixed-previous, which track one sensor");
}

}  // namespace

bool is_by_columns(const SimulationOptions& options) {
    return index_of_name("--fidelity", options.fidelity, {"samples", "columns"}) == 1;
}

SimulationSetup make_simulation(const SimulationOptions& options) {
    refuse_bad_stations(options);
    SimulationSetup setup{make_scenario(options), make_plan(options)};
    refuse_short(options, setup.scenario.duration_s, setup.plan.block_s());
    setup.stations = options.stations;
    const auto& h = options.hemisphere;
    setup.hemisphere = h.empty() ? setup.scenario.motion->at(0).position_m : Vec3<double>(h[0], h[1], h[2]);
    return setup;
}

tracking::TrackerParams<double> make_tracker(const SimulationOptions& options, const SimulationSetup& setup) {
    tracking::TrackerParams<double> params;
    params.method = make_method(options, setup.plan);
    params.common.coupling_constant = setup.scenario.world.coupling_constant_m3;
    params.common.hemisphere = setup.hemisphere;
    params.common.confined = options.confined || !options.hemisphere.empty();
    tracking::set_plan(params.common, setup.plan);
    params.common.quadrature_floor = 0;  // the simulated channels' phases are known
    refuse_bad(tracking::check(params));
    return params;
}

}  // namespace tricoil::host
