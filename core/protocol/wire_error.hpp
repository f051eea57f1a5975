// Errors of received bytes, and their counters.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tricoil::protocol {

enum class WireError : std::uint8_t {
    none,
    too_short,        // shorter than version and type; stream: not longer than a CRC
    unknown_version,  // version not supported
    unknown_type,     // message type not in this version
    wrong_length,     // wrong length for the type on this link
    impossible,       // a number out of the range of its field, or contradictory numbers
    bad_crc,          // stream: CRC mismatch
    bad_framing,      // stream: invalid byte stuffing; segments: out of order or too many
    oversize,         // too long
    wrong_sender,     // message not allowed from this sender, or from an unexpected node
    duplicate_node,   // two devices use one address
    out_of_order,     // older than an accepted message, or repeated
    transition,       // column measured across a change of the excitation state, or in another state than stated
};
constexpr std::size_t kWireErrors = 13;

/// Names for reports, in the order of WireError.
constexpr std::array<const char*, kWireErrors> kWireErrorNames{
    "none",        "too_short", "unknown_version", "unknown_type",   "wrong_length", "impossible", "bad_crc",
    "bad_framing", "oversize",  "wrong_sender",    "duplicate_node", "out_of_order", "transition"};

class WireCounters {
public:
    void count(WireError error) { counts_[static_cast<std::size_t>(error)] += error == WireError::none ? 0U : 1U; }
    [[nodiscard]] std::uint64_t of(WireError error) const { return counts_[static_cast<std::size_t>(error)]; }
    [[nodiscard]] std::uint64_t total() const {
        std::uint64_t sum = 0;
        for (const std::uint64_t n : counts_) {
            sum += n;
        }
        return sum;
    }

private:
    std::array<std::uint64_t, kWireErrors> counts_{};
};

}  // namespace tricoil::protocol
