// Subcommands of the `tricoil` program, one file each.
#pragma once

#include <string>
#include <vector>

#include "board/host/commands/program.hpp"

namespace tricoil::host {

// Each function adds the options of a command to `sub`. If the user selects it, `action` is set.
void add_run_command(CLI::App* sub, Action& action);
void add_selfcheck_command(CLI::App* sub, Action& action);
void add_device_command(CLI::App* sub, Action& action);
void add_doctor_command(CLI::App* sub, Action& action);
void add_replay_command(CLI::App* sub, Action& action);
void add_smooth_command(CLI::App* sub, Action& action);
void add_convert_command(CLI::App* sub, Action& action);
void add_serve_command(CLI::App* sub, Action& action);
void add_demo_command(CLI::App* sub, Action& action);
void add_help_command(CLI::App* sub, Action& action);
void add_completion_command(CLI::App* sub, Action& action);

/// True for a command of python_commands.json, which every executable contains.
bool is_in_python(const std::string& command);
void add_python_command(CLI::App* sub, Action& action);

/// `words` of a command line `calibrate ...`, with the spelling of the last version replaced, in which each kind was an option; a
/// notice on standard error says so. Throws InputError if it names two kinds.
std::vector<std::string> renew_calibrate(const std::vector<std::string>& words);

}  // namespace tricoil::host
