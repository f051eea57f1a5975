// Faults of a device's messages, by column sequence number.
#pragma once

#include <cstdint>

namespace tricoil::sim {

enum class PeerFaultKind : std::uint8_t {
    drop,            // not sent
    swap,            // sent after the next column
    twice,           // sent two times
    truncate,        // truncated
    corrupt,         // impossible numbers
    version,         // unknown protocol version
    type,            // unknown message type
    transition,      // column with the flag that the excitation state changed within its window
    wrong_sequence,  // column with a state sequence that the host never sent
    wrong_coil,      // column of another coil than its state sequence states
    silence,         // no messages, not even status
    second_device,   // a second device answers
};

/// Fault of the columns with sequence numbers `first` to `last`. Status messages and answers are affected while the next column
/// is one of these.
struct PeerFault {
    PeerFaultKind kind = PeerFaultKind::drop;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    [[nodiscard]] bool hits(std::uint32_t n) const { return n >= first && n <= last; }
};

}  // namespace tricoil::sim
