// What a host command throws at its outer edge; main prints it as one line and exits with its code.
#pragma once

#include <stdexcept>
#include <string>

namespace tricoil::host {

/// Exit codes of the `tricoil` program.
enum class ExitCode : int { fine = 0, check_failed = 1, bad_input = 2, device_trouble = 3 };

/// One line for the user: what, where, what to do.
class CommandError : public std::runtime_error {
public:
    CommandError(ExitCode code, const std::string& line) : std::runtime_error(line), code_(code) {}
    [[nodiscard]] ExitCode code() const { return code_; }

private:
    ExitCode code_;
};

/// Wrong usage or wrong input (exit code 2).
class InputError : public CommandError {
public:
    explicit InputError(const std::string& line) : CommandError(ExitCode::bad_input, line) {}
};

}  // namespace tricoil::host
