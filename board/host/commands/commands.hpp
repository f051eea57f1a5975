// The subcommands of the `tricoil` program, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <functional>
#include <string>
#include <system_error>

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

/// Refuses what is no whole number of 64 bits: CLI11 takes a longer one for the largest there is.
inline std::string refuse_overflow(const std::string& text) {
    std::uint64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data(), end, value);
    return error == std::errc{} && at == end ? "" : text + " is no whole number from 0 to 18446744073709551615";
}

}  // namespace tricoil::host
