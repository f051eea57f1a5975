// Flash memory (RM0440 section 5): double-words that are erased, programmed, or damaged by a power failure, in two banks.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Registers at 0x40022000, the bank at 0x08040000, and the data pages of the bank at 0x08000000, whose content is that of
/// Memory. SYSCFG exchanges the banks. The content survives resets and power failures. A double-word is damaged if its
/// programming or erasing was interrupted: reading it raises the NMI until its page is erased. As on the chip, ECCR is unreliable
/// then (ES0430 2.2.3), and erasing or programming with the data cache on is refused (ES0430 2.2.2). The
/// processor waits while the bank that runs is erased or programmed.
class Flash final : public RegisterPeripheral {
public:
    static constexpr std::uint32_t kPageBytes = 2048;
    static constexpr double kProgramS = 85e-6;       // DS12288: 64 bits
    static constexpr double kProgramRowS = 1.95e-3;  // fast programming of 32 double-words
    static constexpr double kEraseS = 22e-3;         // per page, or the whole bank

    explicit Flash(Machine& machine);

    /// The bank that does not run, and the data pages of the one that runs, for the bus.
    Peripheral& other_bank() { return other_bank_; }
    Peripheral& data_page(std::size_t n) {
        has_data_pages_ = true;
        return data_pages_.at(n);
    }
    /// Which bank is at the start of the flash: bank 1, or bank 2 if `exchanged`.
    void exchange_banks(bool exchanged);
    [[nodiscard]] bool is_exchanged() const { return exchanged_; }
    [[nodiscard]] std::uint32_t wait_states() const { return field(registers_[kAcr], 0, 4); }

    /// Calls `act` in the middle of the n-th erase or program operation from now on; 0 is the next one.
    void interrupt_operation(std::uint64_t n, std::function<void()> act);
    /// Power failure: an operation in progress leaves damage.
    void lose_power();

    /// Option bytes (FLASH_OPTR), as if they were loaded now. They survive resets and power failures.
    void set_options(std::uint32_t options);

    /// Content of a bank: bank 1 or 2.
    [[nodiscard]] std::vector<std::uint8_t>& content(int bank = 2) { return content_of((bank == 2) == exchanged_); }
    [[nodiscard]] std::uint64_t operations() const { return operations_; }

    /// Called when an erase or program operation starts.
    std::function<void()> on_operation = [] {};

    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    class Bank final : public Peripheral {
    public:
        Bank(Flash& flash, bool runs, std::uint32_t first = 0) : flash_(flash), runs_(runs), first_(first) {}
        std::uint32_t read(std::uint32_t offset) override { return flash_.read_bank(runs_, first_ + offset); }
        void write(std::uint32_t offset, std::uint32_t value) override { flash_.write_bank(runs_, first_ + offset, value); }
        void reset() override {}

    private:
        Flash& flash_;
        bool runs_;
        std::uint32_t first_;  // offset in the bank
    };
    /// Operation in progress: an erase or the programming of a double-word or a row of them.
    struct Operation {
        bool runs = false;  // in the bank at the start of the flash
        std::uint32_t offset = 0;
        std::vector<std::uint32_t> words;   // empty: erase
        std::uint32_t erased = kPageBytes;  // bytes
    };

    static constexpr std::uint32_t kAcr = 0x00;
    static constexpr std::uint32_t kRowBytes = 256;
    std::uint32_t read_bank(bool runs, std::uint32_t offset);
    void check_bank(bool runs) const;
    void report_damage(std::uint32_t double_word);
    void write_bank(bool runs, std::uint32_t offset, std::uint32_t value);
    [[nodiscard]] std::vector<std::uint8_t>& content_of(bool runs) { return runs ? machine_.memory.flash : content_; }
    [[nodiscard]] std::set<std::uint32_t>& damaged_of(bool runs) { return damaged_[runs ? 1 : 0]; }
    void control(std::uint32_t value);
    void unlock(std::uint32_t key, int& keys, std::array<std::uint32_t, 2> right, unsigned lock);
    [[nodiscard]] bool holds_code(std::uint32_t offset) const;
    void begin(Operation operation, double duration_s);
    void finish();
    void error(unsigned bit);
    void show_interrupt();
    [[nodiscard]] bool is_locked() const;

    Machine& machine_;
    Bank other_bank_;
    std::array<Bank, 2> data_pages_;
    Event finish_;
    Event interrupt_;
    std::vector<std::uint8_t> content_;               // of the bank that does not run
    std::array<std::set<std::uint32_t>, 2> damaged_;  // offsets of double-words: in that bank, in the one that runs
    bool exchanged_ = false;
    std::optional<Operation> operation_;
    std::uint32_t first_place_ = 0;     // address after 0x08000000
    std::vector<std::uint32_t> words_;  // written from there on, until a double-word or a row is complete
    bool has_data_pages_ = false;       // on the bus
    bool is_mass_erased_ = false;       // bank 2, since the last reset
    int keys_ = 0;
    int option_keys_ = 0;
    std::uint32_t options_ = Memory::kUserOptions;
    std::uint64_t operations_ = 0;
    std::optional<std::uint64_t> interrupted_operation_;
    std::function<void()> on_interrupted_;
};

}  // namespace tricoil::virtual_board
