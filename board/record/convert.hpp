// A recording's poses in the forms that other programs read.
#pragma once

#include <cstdio>
#include <string>

#include "board/record/recording.hpp"

namespace tricoil::host {

/// Writes all poses to `out` as one of: jsonl (a JSON object a line, as run --device --json), candump (a log of CAN FD frames by
/// our protocol, for canplayer and the DBC file), openigtlink (the messages of a server on end: TRANSFORM, or STATUS where the
/// pose is not valid; their time stamps count from the recording's own zero). Returns their number. Throws InputError for another
/// form or a damaged line, DeviceError if `out` does not take everything.
std::uint64_t convert(const Recording& recording, const std::string& form, std::FILE* out, const std::string& out_name);

}  // namespace tricoil::host
