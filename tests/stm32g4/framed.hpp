// A message in stream framing.
#pragma once

#include <cstdint>
#include <vector>

#include "core/protocol/stream_framing.hpp"

namespace tricoil::test {

using Bytes = std::vector<std::uint8_t>;

inline Bytes framed(const Bytes& message) {
    Bytes out(protocol::framed_bytes(message.size()));
    out.resize(protocol::frame(message, out));
    return out;
}

}  // namespace tricoil::test
