// A scenario: motion, world and faults.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/motion/motion.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::sim {

struct Scenario {
    std::string name;
    std::string description;
    double duration_s = 10;
    std::unique_ptr<Motion> motion;
    std::vector<Fault> faults;
    WorldParams world;
};

}  // namespace tricoil::sim
