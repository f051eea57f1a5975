// Exit codes and exceptions of host commands. main prints the text of an exception as one line.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

namespace tricoil::host {

/// Exit codes of the `tricoil` program.
enum class ExitCode : int { fine = 0, check_failed = 1, bad_input = 2, device_error = 3 };

constexpr int to_int(ExitCode code) { return static_cast<int>(code); }

/// Wrong usage or input (exit code 2). One line: error, place, remedy.
/// The simulator does not include this header; it throws the base class for an invalid parameter.
class InputError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/// Throws InputError with this text if `is_wrong`.
template <typename... Values>
void refuse_if(bool is_wrong, fmt::format_string<Values...> text, Values&&... values) {
    if (is_wrong) {
        throw InputError(fmt::format(text, std::forward<Values>(values)...));
    }
}

/// A file could not be read from its disk or device (exit code 3). One line that names the file.
class ReadError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A device, disk or bus failed (exit code 3). One line: error, place, remedy.
class DeviceError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A signal ended the command before there was a result (exit code 128 + signal, like the shell).
class Interrupted : public std::runtime_error {
public:
    explicit Interrupted(int signal) : std::runtime_error("interrupted; nothing was written"), signal_(signal) {}
    [[nodiscard]] int exit_code() const { return 128 + signal_; }

private:
    int signal_;
};

}  // namespace tricoil::host
