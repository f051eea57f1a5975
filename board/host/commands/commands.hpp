// Helpers of the subcommands of the `tricoil` program.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/command_list.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {

/// Refuses an empty name: the program would treat it as an omitted option.
inline std::string refuse_empty(const std::string& name) { return name.empty() ? "a name is missing" : ""; }

/// The value is a file or folder. Returns the option.
inline CLI::Option* file_name(CLI::Option* option) { return option->check(refuse_empty)->type_name(kFileType); }

/// Option of commands that take couplings or columns.
constexpr const char* kWiringHelp = "Coil and polarity of each channel: file of tricoil calibrate wiring --out";
inline CLI::Option* wiring_file(CLI::App* sub, std::string& path) {
    return file_name(sub->add_option("--wiring", path, kWiringHelp));
}
inline CLI::Option* folder_name(CLI::Option* option) { return option->check(refuse_empty)->type_name(kFolderType); }
/// The value is `count` numbers; a word behind them is another argument. Returns the option.
inline CLI::Option* numbers(CLI::Option* option, const char* names, int count) {
    return option->type_name(names)->expected(count)->delimiter(',')->allow_extra_args(false);
}
inline CLI::Option* vector_xyz(CLI::Option* option) { return numbers(option, "X,Y,Z", 3); }

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

/// The value is a time in seconds, above 0 or, with `zero`, 0 or more. Returns the option.
inline CLI::Option* seconds(CLI::Option* option, bool zero = false) {
    return option->check(zero ? refuse_negative_time : refuse_nonpositive_time)->type_name("SECONDS");
}

}  // namespace tricoil::host
