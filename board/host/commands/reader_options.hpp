// Options that only Python reads, also of commands that are not in Python alone: a group of python_commands.json.
#pragma once

#include <string>
#include <vector>

#include "board/host/commands/commands.hpp"

namespace tricoil::host {

/// Adds those that the command does not have, with `more_help` at the end of each help. Returns the names of the group.
std::vector<std::string> add_python_options(CLI::App* sub, const std::string& group, const std::string& more_help = "");

/// Of tricoil.read_poses(). With two files the first four take one value for each; two_files: the order of the files, for the
/// help.
std::vector<std::string> add_reader_options(CLI::App* sub, const std::string& two_files = "");

}  // namespace tricoil::host
