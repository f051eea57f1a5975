// Checks the number of metal objects of a scenario, and that no object contains a coil.
#pragma once

#include "sim/world/scenario.hpp"

namespace tricoil::sim {

/// Throws std::invalid_argument for more than 50 objects (a sheet needs some megabytes), and, naming object, coil and time, if an
/// object contains the source at any time, or contains the sensor when the object appears or while it moves. A sensor that moves
/// through an object at rest is allowed: inside, its couplings are those at the object's surface. The first 100 s of an object
/// are checked, every millisecond or more often, at most a million times.
void check_metal(const Scenario& scenario);

}  // namespace tricoil::sim
