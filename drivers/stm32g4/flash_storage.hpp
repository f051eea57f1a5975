// Non-volatile storage in pages of a flash bank. While a page of the bank that runs is erased or programmed, the processor
// stalls.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32g4/registers/flash.hpp"
#include "hal/storage.hpp"

namespace tricoil::stm32g4 {

/// One slot per page. If the programming of a double-word was interrupted, a read of it may raise the NMI. The NMI handler must
/// call on_ecc_error().
class FlashStorage final : public hal::Storage {
public:
    struct Pages {
        volatile std::uint64_t* memory;  // of the first page; kFlashPageBytes per page, without gaps
        std::uint8_t first;              // page number within the bank
        std::uint8_t count;
        bool in_bank_2 = true;
    };

    FlashStorage(FlashRegisters& registers, const Pages& pages) : registers_(registers), pages_(pages) {}

    /// Call from the NMI handler: clears the error, which would otherwise raise the NMI again. True: a read of these pages was in
    /// progress, so the damaged word is in these pages. The address in ECCR is not used, because ECCR is unreliable after an
    /// operation that a reset or a power failure interrupted (ES0430 2.2.3).
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
    void switch_data_cache_off();
    void restore_data_cache();
    [[nodiscard]] bool is_valid_range(std::size_t slot, std::size_t offset, std::size_t bytes) const;
    [[nodiscard]] volatile std::uint64_t* word_at(std::size_t slot, std::size_t offset) const;

    FlashRegisters& registers_;
    Pages pages_;
    std::uint32_t data_cache_ = 0;  // ACR_DCEN if the cache was on before the operation
    volatile bool is_reading_ = false;
    volatile bool is_damaged_ = false;  // the present or last do_read() hit a damaged double-word
};

}  // namespace tricoil::stm32g4
