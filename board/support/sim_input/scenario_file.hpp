// Loads scenarios from TOML: built in or from a file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/world/scenario.hpp"

namespace tricoil::host {

struct ScenarioName {
    std::string name;
    std::string description;
};

/// The built-in scenarios, in alphabetical order.
std::vector<ScenarioName> builtin_scenarios();

/// Loads a built-in scenario, or the file if `name_or_path` ends in .toml. `seed`: for motion and noise. Throws InputError for an
/// unknown name (with the nearest), or with FILE:LINE for a key that is unknown, missing or out of range.
sim::Scenario load_scenario(const std::string& name_or_path, std::uint64_t seed);

}  // namespace tricoil::host
