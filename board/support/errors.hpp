// How a host command ends: exit codes, and what it throws at its outer edge; main prints the text as one line.
#pragma once

#include <stdexcept>
#include <string>

namespace tricoil::host {

/// Exit codes of the `tricoil` program.
enum class ExitCode : int { fine = 0, check_failed = 1, bad_input = 2, device_trouble = 3 };

constexpr int to_int(ExitCode code) { return static_cast<int>(code); }

/// Wrong usage or wrong input (exit code 2). One line: what, where, what to do.
/// The simulator, which knows no program, throws its base class for a parameter that makes no sense.
class InputError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
};

/// A file that the disk or device does not give back (exit code 3). One line that names it.
class ReadError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A device, disk or bus that fails (exit code 3). One line: what, where, what to do.
class DeviceError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Ended by a signal before there was a result (exit code 128 + signal, as the shell reports it).
class Interrupted : public std::runtime_error {
public:
    explicit Interrupted(int signal) : std::runtime_error("interrupted; nothing was written"), signal_(signal) {}
    [[nodiscard]] int exit_code() const { return 128 + signal_; }

private:
    int signal_;
};

}  // namespace tricoil::host
