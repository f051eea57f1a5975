// The subcommands of the `tricoil` program, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace tricoil::host {

/// What the chosen subcommand does once the line is parsed; returns the exit code, may throw CommandError.
using Action = std::function<int()>;

// Each adds its subcommand with options to `program` and, when the user picks it, sets `action`.

}  // namespace tricoil::host
