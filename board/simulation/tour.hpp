// Guided tour of a simulated sensor, for `tricoil demo` and the demo in a browser (board/web).
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "board/simulation/simulation_options.hpp"

namespace tricoil::host {

/// The steps in order: name, sentence (key `shows`), scenario, faults, and `compensated`: with motion compensation at first.
nlohmann::ordered_json tour_steps();

/// Options of a step of tour_steps(). speed: of the motion, relative to the scenario's.
SimulationOptions tour_options(const nlohmann::ordered_json& step, bool compensated, double speed);

}  // namespace tricoil::host
