// Prints text to the terminal with control characters escaped, in colours if the terminal shows them. A failed write does not end
// the program.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace tricoil::host {

/// Replaces control characters, except line feed and tab, by \xNN, including C1 controls (U+0080 to U+009F), so that names and
/// contents of files cannot control the terminal.
std::string terminal_text(std::string_view text);
/// The same, with a blank for each line feed.
std::string one_line(std::string_view text);

/// Prints to standard output. end_standard_output() reports a failure.
void print_text(std::string_view text);
/// From now on print_text() prints to standard error, because the standard output has data.
void print_text_to_standard_error();
/// From now on, text that standard error does not take at once is left out: a stopped terminal or log must not stop tracking.
void do_not_wait_for_standard_error();
enum class Verbosity { quiet, normal, verbose };
/// From now on: quiet prints no hints and no progress, verbose also details. Notices and errors are always printed.
void set_verbosity(Verbosity verbosity);
bool is_quiet();
/// Variable of the environment that hands -q over to a command in Python.
constexpr const char* kQuietVariable = "TRICOIL_QUIET";

/// Prints to standard error. Failures are ignored.
void print_notice(std::string_view text);
/// The same, unless quiet: what the user may want to know, but no program acts on.
void print_hint(std::string_view text);
/// The same, only if verbose.
void print_detail(std::string_view text);
/// Prints "PROGRAM: TEXT" as a line to standard error.
void print_error(std::string_view program, std::string_view text);

/// main() of a program: runs it, and prints an exception as one line. Returns the exit code.
int exit_code_of(std::string_view program, const std::function<int()>& run);

/// Draws a line of progress on a terminal in place of the last one. Text that is printed later replaces it; an empty text removes
/// it. Returns false if the terminal is closed.
bool draw_status_line(std::FILE* terminal, std::string_view text);

/// During its lifetime, texts that this thread prints to standard output are collected here instead.
class CapturedText {
public:
    CapturedText();
    ~CapturedText();
    CapturedText(const CapturedText&) = delete;
    CapturedText& operator=(const CapturedText&) = delete;

    [[nodiscard]] const std::string& text() const { return text_; }

private:
    std::string text_;
    std::string* outer_;
};

template <typename First, typename... Others>
void print_text(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_text(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}
template <typename First, typename... Others>
void print_notice(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_notice(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}
template <typename First, typename... Others>
void print_hint(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_hint(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}
template <typename First, typename... Others>
void print_detail(fmt::format_string<First, Others...> format, First&& first, Others&&... others) {
    print_detail(std::string_view(fmt::format(format, std::forward<First>(first), std::forward<Others>(others)...)));
}

/// After this call a closed pipe on standard output is a failed write and does not end the program.
void ignore_broken_pipe();
/// True if the pipe on standard output was closed since ignore_broken_pipe().
bool reader_is_gone();

/// Flushes standard output. Throws DeviceError if printed text was lost.
void end_standard_output();

enum class Colour : unsigned char { bold, dim, red, green, yellow };

/// True if `file` is a terminal with colours and the user has not set NO_COLOR.
bool has_colours(std::FILE* file);

std::string painted(std::string_view text, Colour colour);

/// Colours lines by their meaning: headings, remarks, warnings, and the words pass and FAIL.
std::string coloured_by_meaning(std::string_view text);

/// Columns of the terminal behind `file`; 80 if `file` is not a terminal or its width is unknown.
std::size_t terminal_width(std::FILE* file);

}  // namespace tricoil::host
