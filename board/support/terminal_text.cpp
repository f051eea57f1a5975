#include "board/support/terminal_text.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <new>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

bool is_heading(std::string_view line) {
    const auto is_plain = [](unsigned char c) { return std::isalpha(c) != 0 || c == ' '; };
    return line.size() > 1 && line.front() != ' ' && line.back() == ':' && std::all_of(line.begin(), line.end() - 1, is_plain);
}

/// Paints the last word if it is `word`.
bool paint_last_word(std::string& line, std::string_view word, Colour colour) {
    if (!line.ends_with(" " + std::string(word))) {
        return false;
    }
    line = line.substr(0, line.size() - word.size()) + painted(word, colour);
    return true;
}

bool paint_prefix(std::string& line, std::string_view prefix, Colour colour) {
    if (!line.starts_with(prefix)) {
        return false;
    }
    line = painted(prefix, colour) + line.substr(prefix.size());
    return true;
}

std::string coloured_line(std::string line) {
    if (is_heading(line)) {
        return painted(line, Colour::bold);
    }
    if (line.starts_with("  # ")) {
        return painted(line, Colour::dim);
    }
    (void)(paint_prefix(line, "warning:", Colour::yellow) || paint_prefix(line, "tricoil:", Colour::yellow) ||
           paint_prefix(line, "Usage:", Colour::bold));
    (void)(paint_last_word(line, "FAIL", Colour::red) || paint_last_word(line, "pass", Colour::green));
    return line;
}

// Static, because a signal handler can access only static storage.
volatile std::sig_atomic_t reader_gone = 0;

std::atomic<bool> text_on_stderr = false;
std::atomic<bool> waits_for_standard_error = true;
std::atomic<int> left_out = 0;  // texts, since the last one
std::atomic<Verbosity> chosen_verbosity = Verbosity::normal;

std::atomic<std::FILE*> status_line = nullptr;  // the terminal that shows one; null: none

constexpr std::string_view kClearLine = "\r\x1b[K";

thread_local std::string* captured = nullptr;  // text of the innermost CapturedText; null: none

void on_broken_pipe(int /*signal*/) { reader_gone = 1; }

bool is_control(unsigned char c) { return (c < ' ' && c != '\n' && c != '\t') || c == 0x7F; }

/// C1 controls are C2 80 to C2 9F in UTF-8.
bool is_c1_control(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
    return byte(at) == 0xC2 && at + 1 < text.size() && byte(at + 1) >= 0x80 && byte(at + 1) <= 0x9F;
}

void put(std::string_view text, std::FILE* file) { (void)std::fwrite(text.data(), 1, text.size(), file); }

/// True if standard error takes a line now. Then tells how many it did not take before.
bool takes_notice() {
    pollfd ready{STDERR_FILENO, POLLOUT, 0};
    if (!waits_for_standard_error && ::poll(&ready, 1, 0) == 0) {
        ++left_out;
        return false;
    }
    if (const int count = left_out.exchange(0); count > 0) {
        put(fmt::format("tricoil: standard error took no text: {} lines were left out\n", count), stderr);
    }
    return true;
}

void print(std::string_view text, std::FILE* file) {
    if (file == stderr && !takes_notice()) {
        return;
    }
    if (status_line != nullptr) {
        (void)draw_status_line(status_line, "");
    }
    const std::string safe = terminal_text(text);
    put(has_colours(file) ? coloured_by_meaning(safe) : safe, file);
}

}  // namespace

std::string terminal_text(std::string_view text) {
    std::string safe;
    safe.reserve(text.size());
    for (std::size_t at = 0; at < text.size(); ++at) {
        const auto c = static_cast<unsigned char>(text[at]);
        if (is_c1_control(text, at)) {
            safe += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[++at]));
        } else if (is_control(c)) {
            safe += fmt::format("\\x{:02x}", c);
        } else {
            safe += text[at];
        }
    }
    return safe;
}

std::string one_line(std::string_view text) {
    std::string line = terminal_text(text);
    std::replace(line.begin(), line.end(), '\n', ' ');
    return line;
}

CapturedText::CapturedText() : outer_(std::exchange(captured, &text_)) {}

CapturedText::~CapturedText() { captured = outer_; }

void print_text(std::string_view text) {
    if (captured != nullptr) {
        captured->append(text);
    } else {
        print(text, text_on_stderr ? stderr : stdout);
    }
}

void print_text_to_standard_error() { text_on_stderr = true; }

void do_not_wait_for_standard_error() { waits_for_standard_error = false; }

void set_verbosity(Verbosity verbosity) { chosen_verbosity = verbosity; }
bool is_quiet() { return chosen_verbosity == Verbosity::quiet || std::getenv(kQuietVariable) != nullptr; }

void print_notice(std::string_view text) { print(text, stderr); }

void print_hint(std::string_view text) {
    if (!is_quiet()) {
        print(text, stderr);
    }
}

void print_detail(std::string_view text) {
    if (chosen_verbosity == Verbosity::verbose) {
        print(text, stderr);
    }
}

void print_error(std::string_view program, std::string_view text) {
    const std::string label = std::string(program) + ":";
    if (status_line != nullptr) {
        (void)draw_status_line(status_line, "");
    }
    if (takes_notice()) {
        put((has_colours(stderr) ? painted(label, Colour::red) : label) + " " + one_line(text) + "\n", stderr);
    }
}

int exit_code_of(std::string_view program, const std::function<int()>& run) {
    const auto report = [&](int code, const char* line) {
        print_error(program, line);
        return code;
    };
    try {
        return run();
    } catch (const std::invalid_argument& error) {
        return report(to_int(ExitCode::bad_input), error.what());
    } catch (const Interrupted& interrupt) {
        return report(interrupt.exit_code(), interrupt.what());
    } catch (const std::bad_alloc&) {
        return report(to_int(ExitCode::device_error), "out of memory; the input is too large for this machine");
    } catch (const std::exception& error) {
        constexpr int kSignalled = 128;  // the exit code is this plus the signal number
        return reader_is_gone() ? kSignalled + SIGPIPE : report(to_int(ExitCode::device_error), error.what());
    }
}

bool draw_status_line(std::FILE* terminal, std::string_view text) {
    status_line = text.empty() ? nullptr : terminal;
    put(kClearLine, terminal);
    put(text, terminal);
    return std::fflush(terminal) == 0 && std::ferror(terminal) == 0;
}

void ignore_broken_pipe() {
    struct sigaction action {};
    action.sa_handler = on_broken_pipe;
    action.sa_flags = SA_RESTART;
    ::sigaction(SIGPIPE, &action, nullptr);
}

bool reader_is_gone() { return reader_gone != 0; }

void end_standard_output() {
    errno = 0;
    const bool flushed = std::fflush(stdout) == 0;
    const std::string reason = errno != 0 ? fmt::format(" ({})", std::strerror(errno)) : "";
    if (!flushed || std::ferror(stdout) != 0) {
        throw DeviceError(fmt::format("standard output could not be written completely{}; is the disk full?", reason));
    }
}

bool has_colours(std::FILE* file) {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const terminal = std::getenv("TERM");
    const bool is_dumb = terminal == nullptr || std::string_view(terminal) == "dumb";
    return (refused == nullptr || *refused == '\0') && !is_dumb && ::isatty(::fileno(file)) == 1;
}

std::string painted(std::string_view text, Colour colour) {
    constexpr int kCodes[] = {1, 2, 31, 32, 33};
    return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<std::size_t>(colour)], text);
}

std::string coloured_by_meaning(std::string_view text) {
    std::string out;
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size());
        out += coloured_line(std::string(text.substr(0, end)));
        out += end < text.size() ? "\n" : "";
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return out;
}

std::size_t terminal_width(std::FILE* file) {
    constexpr std::size_t kUsual = 80;
    winsize size{};
    return ::ioctl(::fileno(file), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

}  // namespace tricoil::host
