// Converts the poses of a recording to formats of other programs.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "board/pose_text/output_format.hpp"
#include "board/record/recording.hpp"
#include "board/support/progress.hpp"

namespace tricoil::host {

/// Names of the forms.
const std::vector<std::string>& convert_formats();

/// Passes all poses to `put` in one of these forms:
/// - jsonl: one JSON object per line, like run --device --json.
/// - csv: the columns of run --out with a device.
/// - full: the same lines as jsonl, with covariance and couplings.
/// - openigtlink: consecutive server messages, TRANSFORM, or STATUS if the pose is invalid. Time stamps are device times,
///   not UTC.
/// options: stages before the form; openigtlink defines its units.
/// progress: called for every pose; may be empty. Returns the number of poses. Throws InputError for an unknown form, and a
/// damaged line.
std::uint64_t convert(const Recording& recording, const std::string& name, const OutputOptions& options,
                      const std::function<void(std::string_view)>& put, const ShowShare& progress = {});

}  // namespace tricoil::host
