// What can go wrong with a peer's messages, by the number of the message.
#pragma once

#include <cstdint>

namespace tricoil::sim {

enum class PeerFaultKind : std::uint8_t {
    drop,        // not sent
    swap,        // sent after the next one
    twice,       // sent two times
    truncate,    // cut off
    corrupt,     // numbers that cannot be
    version,     // of a version nobody speaks
    type,        // of a type that there is not
    transition,  // says that the coils changed within the window
    misecho,     // a column that echoes a state sequence which was never told
    misstate,    // a column of another coil than that of the sequence which it echoes
    silence,     // nothing is sent, status included
    stranger,    // another device answers too
};

/// A fault of the messages from `first` to `last`.
struct PeerFault {
    PeerFaultKind kind = PeerFaultKind::drop;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    [[nodiscard]] bool hits(std::uint32_t n) const { return n >= first && n <= last; }
};

}  // namespace tricoil::sim
