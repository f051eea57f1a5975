// Registers that store the written values, by offset, with the bits that the model knows.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

/// `kWords` registers, of which only the listed ones exist. at() throws RunFailure for any other.
template <std::size_t kWords>
class RegisterFile {
public:
    RegisterFile(std::initializer_list<Register> registers) : RegisterFile(std::vector<Register>(registers)) {}
    explicit RegisterFile(std::vector<Register> registers) : list_(std::move(registers)) {
        for (const Register& r : list_) {
            there_[r.offset / 4] = &r;
            reset_[r.offset / 4] = r.reset;
        }
        reset();
    }
    RegisterFile(const RegisterFile&) = delete;
    RegisterFile& operator=(const RegisterFile&) = delete;

    std::uint32_t& at(std::uint32_t offset) {
        if (!has(offset)) {
            throw RunFailure("no such register in this model");
        }
        return values_[offset / 4];
    }
    /// Call before each write. Throws RunFailure with register and bit if a bit that is not modelled leaves its reset value.
    void check(std::uint32_t offset, std::uint32_t value) const {
        if (has(offset)) {
            there_[offset / 4]->check(value);
        }
    }
    [[nodiscard]] bool has(std::uint32_t offset) const {
        return (offset & 3U) == 0 && offset / 4 < kWords && there_[offset / 4] != nullptr;
    }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t offset) const { return values_[offset / 4]; }
    [[nodiscard]] std::span<const Register> list() const { return list_; }
    void reset() { values_ = reset_; }

private:
    std::vector<Register> list_;
    std::array<const Register*, kWords> there_{};
    std::array<std::uint32_t, kWords> reset_{};
    std::array<std::uint32_t, kWords> values_{};
};

/// Field of `width` bits at bit `at`.
constexpr std::uint32_t field(std::uint32_t word, unsigned at, unsigned width) { return word >> at & ((1U << width) - 1U); }
constexpr bool is_set(std::uint32_t word, unsigned at) { return (word >> at & 1U) != 0; }
constexpr std::uint32_t flag(bool set, unsigned at) { return set ? 1U << at : 0U; }

}  // namespace tricoil::virtual_board
