// Defaults of the user's options: ~/.config/tricoil.toml.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tricoil::host {

struct UserDefaults {
    std::string path;    // empty: there is no file
    std::string device;  // these three as on the command line; empty: no default
    std::string hemisphere;
    std::string units;
};

/// Reads tricoil.toml in $XDG_CONFIG_HOME or ~/.config. Throws InputError, naming file and line.
UserDefaults read_user_defaults();

/// Adds the defaults for options that the words do not give: --device of run and serve, unless the sensor is simulated or
/// recorded; DEVICE of tricoil device; --hemisphere of a device; --units of outputs as text. Hints name them.
std::vector<std::string> with_user_defaults(const CLI::App& program, std::vector<std::string> words);

}  // namespace tricoil::host
