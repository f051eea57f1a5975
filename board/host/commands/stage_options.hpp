// Options of the stages between a source of poses and its outputs, for all commands that write poses.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "board/pose_text/output_format.hpp"

namespace tricoil::host {

/// Adds --tip, --relative-to, --align, --boresight, --units and --euler. Returns them.
std::vector<const CLI::Option*> add_stage_options(CLI::App* sub, OutputOptions& options);

/// Throws InputError if stages are given without an output: they change the written poses only. mend: end of the message.
void refuse_without_output(const std::vector<const CLI::Option*>& stages, bool has_output, const std::string& mend,
                           bool tip_is_published = false);

/// Throws InputError if there is no sensor of --relative-to. more: end of the message.
void check_reference(const OutputOptions& options, int sensors, const std::string& more = {});

}  // namespace tricoil::host
