// Values of the options of `tricoil` for completion: scenarios, faults, devices, commands.
#pragma once

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

// Type names of the options whose values option_values() lists.
constexpr const char* kScenarioType = "SCENARIO";
constexpr const char* kFaultType = "FAULT";
constexpr const char* kDeviceType = "DEVICE";
constexpr const char* kCommandType = "COMMAND";

ValueSources option_values(const CLI::App& program);

}  // namespace tricoil::host
