// A recording's poses in the forms that other programs read.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "board/record/recording.hpp"

namespace tricoil::host {

/// Gives all poses to `put` as one of: jsonl (a JSON object a line, as run --device --json), candump (a log of CAN FD frames by
/// our protocol, for canplayer and the DBC file), openigtlink (the messages of a server on end: TRANSFORM, or STATUS where the
/// pose is not valid; their time stamps count from the recording's own zero). Returns their number. Throws InputError for another
/// form or a damaged line.
std::uint64_t convert(const Recording& recording, const std::string& form, const std::function<void(std::string_view)>& put);

}  // namespace tricoil::host
