// What can be wrong with received bytes, and how often it was.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tricoil::protocol {

enum class WireError : std::uint8_t {
    none,
    too_short,        // less than version, type and stamp
    unknown_version,  // a version that this code does not speak
    unknown_type,     // a message that this version does not have
    wrong_length,     // not the length that the type has on this link
    impossible,       // a number outside the range of its field, or numbers that contradict each other
    bad_crc,          // stream: the check value does not match
    bad_framing,      // stream: zero codes that cannot be; segments out of order or too many
    oversize,         // longer than any message
    wrong_sender,     // a message that this peer has no business to send, or of a node that nobody asked
    duplicate_node,   // two devices answer to one address
    out_of_order,     // older than what has been taken already, or twice the same
    transition,       // a column during whose window the coils changed, or of another excitation than it says
};
constexpr std::size_t kWireErrors = 13;

/// For reports; the order of WireError.
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
