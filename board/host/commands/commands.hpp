// The subcommands of the `tricoil` program, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace tricoil::host {

/// What the chosen subcommand does once the line is parsed; returns the exit code, may throw InputError or DeviceError.
using Action = std::function<int()>;

// Each adds its subcommand with options to `program` and, when the user picks it, sets `action`.
void add_run_command(CLI::App& program, Action& action);
void add_demodulate_command(CLI::App& program, Action& action);
void add_figures_command(CLI::App& program, Action& action);
void add_motion_command(CLI::App& program, Action& action);
void add_selfcheck_command(CLI::App& program, Action& action);
void add_calibrate_command(CLI::App& program, Action& action);
void add_evaluate_command(CLI::App& program, Action& action);
void add_protocol_command(CLI::App& program, Action& action);
void add_device_command(CLI::App& program, Action& action);
void add_replay_command(CLI::App& program, Action& action);
void add_convert_command(CLI::App& program, Action& action);
void add_serve_command(CLI::App& program, Action& action);

/// Refuses an empty name, which would mean another thing than leaving the option out.
inline std::string refuse_empty(const std::string& name) { return name.empty() ? "a name is missing" : ""; }

}  // namespace tricoil::host
