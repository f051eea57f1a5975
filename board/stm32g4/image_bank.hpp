// The flash bank that does not run, as memory for a new image, and the log of the selector.
#pragma once

#include "board/stm32g4/flash_layout.hpp"
#include "drivers/stm32g4/flash_storage.hpp"
#include "drivers/stm32g4/processor.hpp"
#include "hal/image_bank.hpp"

namespace tricoil::stm32g4_board {

/// True if bank 2 runs: it is at the start of the flash. The clock of SYSCFG, which the selector has switched on, must be on.
[[nodiscard]] bool runs_bank_2();

/// Pages of a bank, wherever it is. first: number within the bank.
[[nodiscard]] stm32g4::FlashStorage::Pages pages_of(bool bank_2, std::uint8_t first, std::uint8_t count);

/// An image without its first double-word is no program for the selector. This double-word is written last.
class FlashImageBank final : public hal::ImageBank {
public:
    FlashImageBank(stm32g4::FlashRegisters& registers, stm32g4::Processor& processor);

    /// Reads the log. NMIs must already reach on_ecc_error().
    void begin();

    /// As that of FlashStorage.
    bool on_ecc_error() { return log_.on_ecc_error(); }

private:
    Status do_write(std::uint32_t offset, std::span<const std::uint8_t> part) override;
    [[nodiscard]] std::uint32_t do_size() const override { return size_; }
    [[nodiscard]] bool do_is_complete() const override { return is_sound_; }
    void do_restart(bool on_trial) override;
    [[nodiscard]] bool do_is_on_trial() const override { return is_on_trial_; }
    Status do_confirm() override;

    bool start_image(std::span<const std::uint8_t> part);
    Status program(std::uint32_t at, std::uint64_t word);
    Status complete();

    stm32g4::Processor& processor_;
    stm32g4::FlashStorage image_;
    stm32g4::FlashStorage log_;
    std::size_t next_entry_ = 0;
    bool is_on_trial_ = false;
    std::uint32_t size_ = 0;        // bytes stored
    std::uint32_t whole_ = 0;       // bytes of the image
    std::uint64_t first_word_ = 0;  // written last
    bool is_sound_ = false;
};

}  // namespace tricoil::stm32g4_board
