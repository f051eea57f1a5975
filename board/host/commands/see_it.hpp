// The command that shows a simulated run on the live page, to be pasted.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tricoil::host {

/// "PROGRAM serve --web 8080" with those options of the run that `serve` has too, except its duration and recording.
std::string see_it_command(const CLI::App& run, const std::vector<const CLI::Option*>& shared);

}  // namespace tricoil::host
