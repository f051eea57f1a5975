// Subcommands of the `tricoil` program, one file each.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/program.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {

// Each function adds the options of a command to `sub`. If the user selects it, `action` is set.
void add_run_command(CLI::App* sub, Action& action);
void add_demodulate_command(CLI::App* sub, Action& action);
void add_figures_command(CLI::App* sub, Action& action);
void add_motion_command(CLI::App* sub, Action& action);
void add_selfcheck_command(CLI::App* sub, Action& action);
void add_calibrate_command(CLI::App* sub, Action& action);
void add_evaluate_command(CLI::App* sub, Action& action);
void add_protocol_command(CLI::App* sub, Action& action);
void add_device_command(CLI::App* sub, Action& action);
void add_doctor_command(CLI::App* sub, Action& action);
void add_replay_command(CLI::App* sub, Action& action);
void add_smooth_command(CLI::App* sub, Action& action);
void add_convert_command(CLI::App* sub, Action& action);
void add_couplings_command(CLI::App* sub, Action& action);
void add_plot_command(CLI::App* sub, Action& action);
void add_serve_command(CLI::App* sub, Action& action);
void add_demo_command(CLI::App* sub, Action& action);
void add_help_command(CLI::App* sub, Action& action);
void add_completion_command(CLI::App* sub, Action& action);

/// `words` of a command line `calibrate ...`, with the spelling of the last version replaced, in which each kind was an option; a
/// notice on standard error says so. Throws InputError if it names two kinds.
std::vector<std::string> renew_calibrate(const std::vector<std::string>& words);

/// Refuses an empty name: the program would treat it as an omitted option.
inline std::string refuse_empty(const std::string& name) { return name.empty() ? "a name is missing" : ""; }

/// The value is a file or folder. Returns the option.
inline CLI::Option* file_name(CLI::Option* option) { return option->check(refuse_empty)->type_name(kFileType); }
inline CLI::Option* folder_name(CLI::Option* option) { return option->check(refuse_empty)->type_name(kFolderType); }
/// The value is a vector. Returns the option.
inline CLI::Option* vector_xyz(CLI::Option* option) { return option->type_name("X,Y,Z")->expected(3)->delimiter(','); }

/// Refuses a text that is not a 64-bit unsigned integer: CLI11 replaces a larger number by the maximum.
inline std::string refuse_overflow(const std::string& text) {
    return number_from<std::uint64_t>(text) ? "" : text + " is not an integer from 0 to 18446744073709551615";
}

/// Refuses a text that is not a finite number of seconds, 0 or more; without `zero`, above 0.
inline std::string refuse_bad_time(const std::string& text, bool zero) {
    const double value = number_from<double>(text).value_or(-1);
    const bool fits = std::isfinite(value) && (value > 0 || (zero && value == 0));
    return fits ? "" : text + (zero ? " is not a number of seconds, 0 or more" : " is not a positive number of seconds");
}
inline std::string refuse_negative_time(const std::string& text) { return refuse_bad_time(text, true); }
inline std::string refuse_nonpositive_time(const std::string& text) { return refuse_bad_time(text, false); }

}  // namespace tricoil::host
