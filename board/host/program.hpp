// The commands of the `tricoil` program, for the program and for the Python package.
#pragma once

#include <string>
#include <vector>

namespace tricoil::host {

struct ProgramIdentity {
    std::string typed_name = "tricoil";  // as the user typed it: printed in commands that can be pasted
    std::string version = "tricoil " TRICOIL_VERSION;
};

/// Parses the arguments and runs the subcommand. Returns its exit code. Throws InputError for wrong usage or input, DeviceError,
/// ReadError, or Interrupted after a signal.
int run_program(const std::vector<std::string>& arguments, const ProgramIdentity& identity = {});

}  // namespace tricoil::host
