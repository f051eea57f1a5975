// Flash memory with power failures on demand.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/storage.hpp"

namespace tricoil::sim {

/// Behaves like a microcontroller's flash: a double-word is programmed once after an erase, and a double-word with interrupted
/// programming is unreadable. An interrupted erase leaves unchanged, erased and unreadable words. After a power failure every
/// erase and program operation fails until restore_power(); read() still works.
class SimulatedStorage final : public hal::Storage {
public:
    SimulatedStorage(std::size_t slots, std::size_t slot_bytes);

    /// Power fails within the erase or program operation number `operations` from now on; 1 is the next one.
    void fail_power_after(std::uint64_t operations) { left_ = operations; }
    void restore_power() { left_ = kForever; }
    [[nodiscard]] bool has_power() const { return left_ > 0; }

    /// Damages a double-word: reading it fails, like an uncorrectable ECC error.
    void damage(std::size_t slot, std::size_t offset) { word(slot, offset).is_damaged = true; }
    /// Flips bits of a double-word; the memory does not detect it.
    void corrupt(std::size_t slot, std::size_t offset, std::uint64_t bits) { word(slot, offset).value ^= bits; }

    [[nodiscard]] std::uint64_t operations() const { return operations_; }

private:
    static constexpr std::uint64_t kForever = ~std::uint64_t{0};
    struct Word {
        std::uint64_t value = ~std::uint64_t{0};
        bool is_damaged = false;
    };

    [[nodiscard]] std::size_t do_slots() const override { return slots_; }
    [[nodiscard]] std::size_t do_slot_bytes() const override { return slot_bytes_; }
    Status do_erase(std::size_t slot) override;
    Status do_program(std::size_t slot, std::size_t offset, std::uint64_t value) override;
    Status do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) override;

    [[nodiscard]] bool is_valid_range(std::size_t slot, std::size_t offset, std::size_t bytes) const;
    Word& word(std::size_t slot, std::size_t offset) { return words_[(slot * slot_bytes_ + offset) / kWordBytes]; }
    bool fails_now();

    std::size_t slots_;
    std::size_t slot_bytes_;
    std::vector<Word> words_;
    std::uint64_t left_ = kForever;
    std::uint64_t operations_ = 0;
};

}  // namespace tricoil::sim
