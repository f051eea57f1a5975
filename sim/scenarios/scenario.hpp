// A scenario: how the sensor moves, what the world is like, what breaks. Read from TOML, built in or from a file.
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

struct ScenarioName {
    std::string name;
    std::string description;
};

/// The built-in scenarios, in alphabetical order.
std::vector<ScenarioName> builtin_scenarios();

/// A built-in scenario, or the file if `name_or_path` ends in .toml. `seed` goes to the motion and to the noise.
/// Throws InputError: unknown name (with the nearest), or FILE:LINE and the key that is unknown, missing or out of range.
Scenario load_scenario(const std::string& name_or_path, std::uint64_t seed);

}  // namespace tricoil::sim
