// Numbers of poses that go on when their trackers or their device start again.
#pragma once

#include <cstdint>
#include <utility>

namespace tricoil::host {

class ContinuedSequence {
public:
    /// The next number is the first one after a start.
    void begin() { is_first_ = true; }

    /// The number as it leaves: greater than all before. Numbers that went on by themselves stay as they are.
    std::uint32_t next(std::uint32_t number) {
        if (std::exchange(is_first_, false) && number + offset_ < next_) {
            offset_ = next_ - number;
        }
        next_ = number + offset_ + 1;
        return number + offset_;
    }

private:
    bool is_first_ = false;
    std::uint32_t offset_ = 0;
    std::uint32_t next_ = 0;
};

}  // namespace tricoil::host
