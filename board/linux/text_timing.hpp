// Rate and multiplexing of columns, from the times of the first ones.
#pragma once

#include <optional>
#include <vector>

#include "board/linux/text_name.hpp"
#include "board/linux/text_rows.hpp"

namespace tricoil::linux_board {

struct TextTiming {
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    double rate_hz = 240;  // frames a second
};

/// Number of frames that is always enough.
inline constexpr std::size_t kFirstFrames = 32;

/// What the keys of the name do not tell follows from `frames`, which must not be empty. is_all: more frames do not come.
/// Nullopt: more are needed.
std::optional<TextTiming> timing_of(const std::vector<TextFrame>& frames, const TextName& name, bool is_all);

}  // namespace tricoil::linux_board
