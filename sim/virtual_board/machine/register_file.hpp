// Registers that store the written values, by offset, with the bits that the model knows.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {

/// Only the listed registers exist. at() throws RunFailure for any other.
class RegisterFile {
public:
    explicit RegisterFile(std::vector<Register> registers) : list_(std::move(registers)) {
        for (const Register& r : list_) {
            there_.resize(std::max<std::size_t>(there_.size(), r.offset / 4 + 1));
            there_[r.offset / 4] = &r;
        }
        values_.resize(there_.size());
        reset();
    }
    RegisterFile(const RegisterFile&) = delete;
    RegisterFile& operator=(const RegisterFile&) = delete;

    std::uint32_t& at(std::uint32_t offset) {
        fail_if(!has(offset), "no such register in this model");
        return values_[offset / 4];
    }
    /// Call before each write. Throws RunFailure with register and bit if a bit that is not modelled leaves its reset value.
    void check(std::uint32_t offset, std::uint32_t value) const {
        if (has(offset)) {
            there_[offset / 4]->check(value);
        }
    }
    [[nodiscard]] bool has(std::uint32_t offset) const {
        return (offset & 3U) == 0 && offset / 4 < there_.size() && there_[offset / 4] != nullptr;
    }
    [[nodiscard]] std::uint32_t modelled(std::uint32_t offset) const { return there_[offset / 4]->modelled; }
    [[nodiscard]] std::uint32_t operator[](std::uint32_t offset) const { return values_[offset / 4]; }
    [[nodiscard]] std::span<const Register> list() const { return list_; }
    void reset() {
        for (const Register& r : list_) {
            values_[r.offset / 4] = r.reset;
        }
    }

private:
    std::vector<Register> list_;
    std::vector<const Register*> there_;
    std::vector<std::uint32_t> values_;
};

/// A peripheral with such registers. Access to part of a register is refused.
class RegisterPeripheral : public Peripheral {
public:
    explicit RegisterPeripheral(std::vector<Register> registers) : registers_(std::move(registers)) {}

    std::uint32_t read(std::uint32_t offset) override { return registers_.at(offset); }
    void write(std::uint32_t offset, std::uint32_t value) final {
        registers_.check(offset, value);
        apply(offset, value);
    }
    [[nodiscard]] std::span<const Register> registers() const final { return registers_.list(); }
    void reset() override { registers_.reset(); }

protected:
    /// The effect of a write, after the check of its bits.
    virtual void apply(std::uint32_t offset, std::uint32_t value) { registers_.at(offset) = value; }

    RegisterFile registers_;
};

/// Field of `width` bits at bit `at`.
constexpr std::uint32_t field(std::uint32_t word, unsigned at, unsigned width) { return word >> at & ((1U << width) - 1U); }
constexpr bool is_set(std::uint32_t word, unsigned at) { return (word >> at & 1U) != 0; }
constexpr std::uint32_t flag(bool set, unsigned at) { return set ? 1U << at : 0U; }
/// `word` with `bytes` bytes at `offset` replaced.
constexpr std::uint32_t with_part(std::uint32_t word, std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    const unsigned shift = 8 * (offset & 3U);
    const std::uint32_t mask = ((1U << 8U * bytes) - 1U) << shift;
    return (word & ~mask) | (value << shift & mask);
}

}  // namespace tricoil::virtual_board
