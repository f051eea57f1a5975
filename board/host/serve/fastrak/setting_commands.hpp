// FASTRAK commands that only read or change settings.
#pragma once

#include <string>

#include "board/host/serve/fastrak/arguments.hpp"
#include "board/host/serve/fastrak/station.hpp"

namespace tricoil::host::fastrak {

/// Letters of the commands that execute_setting() executes.
constexpr std::string_view kSettingCommands = "OGARNIQVrexvXyo";

/// Executes the command with this letter. Returns the record to send; empty: none. Throws Refusal, with unchanged settings, for
/// missing or invalid arguments.
std::string execute_setting(Settings& settings, char letter, const Arguments& arguments);

}  // namespace tricoil::host::fastrak
