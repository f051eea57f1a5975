// Checks the number of metal objects of a scenario, and that none contains a coil.
#pragma once

#include "sim/world/scenario.hpp"

namespace tricoil::sim {

/// Throws std::invalid_argument for more than 50 objects (a sheet needs 5 MB), and, naming object, coil and time, if one contains
/// the source at any time, or the sensor when it appears or while it moves. A sensor whose own motion leads through an object at
/// rest is allowed: there its couplings are those of the object's surface. The first 100 s of an object are checked, every
/// millisecond or more often, at most a million times.
void check_metal(const Scenario& scenario);

}  // namespace tricoil::sim
