// The subcommands of the `tricoil` program, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

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

}  // namespace tricoil::host
