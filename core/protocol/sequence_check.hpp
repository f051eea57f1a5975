// Order and completeness of one stream of sequence numbers.
#pragma once

#include <cstdint>

namespace tricoil::protocol {

enum class Order : std::uint8_t {
    next,    // expected number
    gap,     // numbers before it are missing
    old,     // repeated, or overtaken by a later one
    strange  // far from the expected number: another stream, or the sender restarted
};

class SequenceCheck {
public:
    /// Largest difference from the expected number; beyond it a number is `strange`.
    static constexpr std::int32_t kFarthest = 4096;

    Order check(std::uint32_t sequence) {
        const auto ahead = static_cast<std::int32_t>(sequence - expected_);  // modulo 2^32
        if (started_ && (ahead > kFarthest || ahead < -kFarthest)) {
            return Order::strange;
        }
        if (started_ && ahead < 0) {
            return Order::old;
        }
        const bool gap = started_ && ahead > 0;
        lost_ += gap ? static_cast<std::uint32_t>(ahead) : 0U;
        expected_ = sequence + 1;
        started_ = true;
        return gap ? Order::gap : Order::next;
    }

    /// The next number starts a new stream. The count of lost messages stays.
    void restart() { started_ = false; }
    [[nodiscard]] std::uint64_t lost() const { return lost_; }
    [[nodiscard]] bool started() const { return started_; }
    [[nodiscard]] std::uint32_t newest() const { return expected_ - 1; }

private:
    std::uint32_t expected_ = 0;
    std::uint64_t lost_ = 0;
    bool started_ = false;
};

}  // namespace tricoil::protocol
