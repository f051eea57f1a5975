// Converts the options of a simulated run to scenario, acquisition plan and tracker.
#pragma once

#include "board/simulation/simulation_options.hpp"
#include "core/tracking/dual_band/two_bands.hpp"
#include "core/tracking/tracker_params.hpp"
#include "sim/world/scenario.hpp"

namespace tricoil::host {

struct SimulationSetup {
    sim::Scenario scenario;
    signal::AcquisitionPlan plan;
    Vec3<double> hemisphere = Vec3<double>::UnitX();  // at the start
    int stations = 1;
    std::optional<signal::LowBandPlan> low_band;
};

/// Throws InputError, naming the option, for invalid options.
SimulationSetup make_simulation(const SimulationOptions& options);

/// Parameters of a floating-point tracker. Throws InputError for an unknown tracker or invalid options.
tracking::TrackerParams<double> make_tracker(const SimulationOptions& options, const SimulationSetup& setup);

/// Correction by the second band; empty with one band. `world` must be configured.
std::optional<tracking::TwoBandParams> make_two_bands(const SimulationSetup& setup, const sim::CoilWorld& world);

}  // namespace tricoil::host
