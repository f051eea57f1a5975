// Text for the person at the terminal: without control characters of others, and never the end of the program.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace tricoil::host {

/// `text` with every control character but line feed and tab as \xNN, C1 controls (U+0080 to U+009F) too: names and contents of
/// files reach no terminal as commands.
std::string terminal_text(std::string_view text);

/// To standard output. A failure is kept by the stream; end_standard_output() tells it.
void print_text(std::string_view text);
/// To standard error. Whether anybody can read it makes no difference to what the program does.
void print_notice(std::string_view text);

template <typename First, typename... Others>
void print_text(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_text(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}
template <typename First, typename... Others>
void print_notice(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_notice(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}

/// From now on a reader of standard output that goes away is a failed write and no end of the program.
void outlive_readers();
/// Whether the reader of standard output has gone away since.
bool reader_is_gone();

/// Flushes standard output. Throws DeviceError if something that was printed is lost.
void end_standard_output();

}  // namespace tricoil::host
