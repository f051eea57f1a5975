// Converts the options of a simulated run to scenario, acquisition plan and tracker.
#pragma once

#include "board/simulation/simulation_options.hpp"
#include "core/tracking/tracker_params.hpp"
#include "sim/world/scenario.hpp"

namespace tricoil::host {

struct SimulationSetup {
    sim::Scenario scenario;
    signal::AcquisitionPlan plan;
    Vec3<double> hemisphere = Vec3<double>::UnitX();  // at the start
    int stations = 1;
};

/// Throws InputError for an unknown fidelity.
bool is_by_columns(const SimulationOptions& options);

/// Throws InputError, naming the option, for invalid options.
SimulationSetup make_simulation(const SimulationOptions& options);

/// Parameters of a floating-point tracker. Throws InputError for an unknown tracker or invalid options.
tracking::TrackerParams<double> make_tracker(const SimulationOptions& options, const SimulationSetup& setup);

}  // namespace tricoil::host
