// Flash memory (RM0440 section 5): bank 2, in double-words that are erased, programmed, or damaged by a power failure.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Registers at 0x40022000 and bank 2 at 0x08040000. The content survives resets and power failures. A double-word is damaged if
/// its programming or erasing was interrupted: reading it raises the NMI until its page is erased. As on the chip, ECCR is
/// unreliable then (ES0430 2.2.3), and erasing or programming with the data cache on is refused (ES0430 2.2.2).
class Flash final : public RegisterPeripheral {
public:
    static constexpr std::uint32_t kPageBytes = 2048;
    static constexpr double kProgramS = 85e-6;  // DS12288: 64 bits
    static constexpr double kEraseS = 22e-3;    // per page, or the whole bank

    explicit Flash(Machine& machine);

    /// Bank 2, for the bus.
    Peripheral& bank() { return bank_; }
    [[nodiscard]] std::uint32_t wait_states() const { return field(registers_[kAcr], 0, 4); }

    /// Calls `act` in the middle of the n-th erase or program operation from now on; 0 is the next one.
    void interrupt_operation(std::uint64_t n, std::function<void()> act);
    /// Power failure: an operation in progress leaves damage.
    void lose_power();

    /// Option bytes (FLASH_OPTR), as if they were loaded now. They survive resets and power failures.
    void set_options(std::uint32_t options);

    [[nodiscard]] std::vector<std::uint8_t>& content() { return content_; }
    [[nodiscard]] std::set<std::uint32_t>& damaged() { return damaged_; }
    [[nodiscard]] std::uint64_t operations() const { return operations_; }

    /// Called when an erase or program operation starts.
    std::function<void()> on_operation = [] {};

    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    class Bank final : public Peripheral {
    public:
        explicit Bank(Flash& flash) : flash_(flash) {}
        std::uint32_t read(std::uint32_t offset) override { return flash_.read_bank(offset); }
        void write(std::uint32_t offset, std::uint32_t value) override { flash_.write_bank(offset, value); }
        void reset() override {}

    private:
        Flash& flash_;
    };
    /// Operation in progress: an erase or the programming of a double-word.
    struct Operation {
        std::uint32_t offset = 0;
        std::optional<std::array<std::uint32_t, 2>> words;  // empty: erase
        std::uint32_t erased = kPageBytes;                  // bytes
    };

    static constexpr std::uint32_t kAcr = 0x00;
    std::uint32_t read_bank(std::uint32_t offset);
    void check_banks() const;
    void report_damage(std::uint32_t double_word);
    void write_bank(std::uint32_t offset, std::uint32_t value);
    void control(std::uint32_t value);
    void unlock(std::uint32_t key);
    void begin(Operation operation, double duration_s);
    void finish();
    void error(unsigned bit);
    void show_interrupt();
    [[nodiscard]] bool is_locked() const;

    Machine& machine_;
    Bank bank_;
    Event finish_;
    Event interrupt_;
    std::vector<std::uint8_t> content_;
    std::set<std::uint32_t> damaged_;  // offsets of double-words
    std::optional<Operation> operation_;
    std::optional<std::array<std::uint32_t, 2>> first_word_;  // offset, value
    int keys_ = 0;
    std::uint32_t options_ = Memory::kUserOptions;
    std::uint64_t operations_ = 0;
    std::optional<std::uint64_t> interrupted_operation_;
    std::function<void()> on_interrupted_;
};

}  // namespace tricoil::virtual_board
