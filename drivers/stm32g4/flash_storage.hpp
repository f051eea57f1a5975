// What is remembered: pages of the flash's second bank, while the program runs from the first.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32g4/registers/flash.hpp"
#include "hal/storage.hpp"

namespace tricoil::stm32g4 {

/// One page a slot. A double-word whose programming was interrupted may be unreadable: reading it raises the NMI, whose handler
/// calls on_ecc_error().
class FlashStorage final : public hal::Storage {
public:
    struct Pages {
        volatile std::uint64_t* memory;  // of the first page; kFlashPageBytes a page, no gaps
        std::uint8_t first;              // its number within bank 2
        std::uint8_t count;
    };

    FlashStorage(FlashRegisters& registers, const Pages& pages) : registers_(registers), pages_(pages) {}

    /// From the NMI's handler: clears the error, which would raise it for ever. False: there was none, or not in these pages.
    bool on_ecc_error();

private:
    [[nodiscard]] std::size_t do_slots() const override { return pages_.count; }
    [[nodiscard]] std::size_t do_slot_bytes() const override { return kFlashPageBytes; }
    Status do_erase(std::size_t slot) override;
    Status do_program(std::size_t slot, std::size_t offset, std::uint64_t word) override;
    Status do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) override;

    [[nodiscard]] bool has_two_banks() const;
    Status unlock();
    Status finish();
    std::uint32_t take_errors();
    void forget_cached();
    [[nodiscard]] bool holds(std::size_t slot, std::size_t offset, std::size_t bytes) const;
    [[nodiscard]] volatile std::uint64_t* word_at(std::size_t slot, std::size_t offset) const;

    FlashRegisters& registers_;
    Pages pages_;
    volatile bool is_damaged_ = false;  // something that was read since this was cleared
};

}  // namespace tricoil::stm32g4
