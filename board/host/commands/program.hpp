// The commands of the `tricoil` program: in one list, in several executables, and in the Python package.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): of the library
class App;
}

namespace tricoil::host {

/// Action of the selected command. Returns the exit code; may throw the exceptions of errors.hpp.
using Action = std::function<int()>;

/// A command that this executable contains. `add` adds its options to `sub`; if the user selects it, `action` is set.
struct OwnCommand {
    const char* name;
    void (*add)(CLI::App* sub, Action& action);
};

/// Of the executable that includes main.cpp.
std::span<const OwnCommand> own_commands();

struct ProgramIdentity {
    std::string typed_name = "tricoil";  // as the user typed it: printed in commands that can be pasted
    std::string version = "tricoil " TRICOIL_VERSION;
    bool uses_defaults = false;  // of ~/.config/tricoil.toml
};

/// Parses the arguments and runs the command. Returns its exit code. Throws InputError for wrong usage or input, DeviceError,
/// ReadError, or Interrupted after a signal. If another executable contains the command, this process continues as that one:
/// ../libexec/tricoil/tricoil-NAME from the folder of this executable, never from PATH or the current folder.
int run_program(const std::vector<std::string>& arguments, std::span<const OwnCommand> own, const ProgramIdentity& identity = {});

/// Continues as _program.py beside this executable, with the options of `command` that were given. Python is that of the system.
int continue_in_python(const CLI::App& command);

}  // namespace tricoil::host
