// Registers that store the written values, by offset.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

/// `kWords` registers, of which only the listed ones exist. at() throws RunFailure for any other.
template <std::size_t kWords>
class RegisterFile {
public:
    struct Reset {
        std::uint32_t offset;
        std::uint32_t value;
    };

    RegisterFile(std::initializer_list<Reset> registers) {
        for (const Reset& r : registers) {
            there_[r.offset / 4] = true;
            reset_[r.offset / 4] = r.value;
        }
        reset();
    }

    std::uint32_t& at(std::uint32_t offset) {
        if ((offset & 3U) != 0 || offset / 4 >= kWords || !there_[offset / 4]) {
            throw RunFailure("no such register in this model");
        }
        return values_[offset / 4];
    }
    [[nodiscard]] bool has(std::uint32_t offset) const { return (offset & 3U) == 0 && offset / 4 < kWords && there_[offset / 4]; }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t offset) const { return values_[offset / 4]; }
    void reset() { values_ = reset_; }

private:
    std::array<bool, kWords> there_{};
    std::array<std::uint32_t, kWords> reset_{};
    std::array<std::uint32_t, kWords> values_{};
};

/// Field of `width` bits at bit `at`.
constexpr std::uint32_t field(std::uint32_t word, unsigned at, unsigned width) { return word >> at & ((1U << width) - 1U); }
constexpr bool is_set(std::uint32_t word, unsigned at) { return (word >> at & 1U) != 0; }
constexpr std::uint32_t flag(bool set, unsigned at) { return set ? 1U << at : 0U; }

}  // namespace tricoil::virtual_board
