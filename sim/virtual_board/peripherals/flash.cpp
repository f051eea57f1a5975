#include "sim/virtual_board/peripherals/flash.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace tricoil::virtual_board {
namespace flash {

constexpr std::uint32_t kKeyr = 0x08;
constexpr std::uint32_t kSr = 0x10;
constexpr std::uint32_t kCr = 0x14;
constexpr std::uint32_t kEccr = 0x18;
constexpr std::uint32_t kOptr = 0x20;

constexpr unsigned kDataCache = 10;
constexpr unsigned kDualBank = 22;  // DBANK

constexpr unsigned kEndOfOperation = 0;
constexpr unsigned kOperationError = 1;
constexpr unsigned kProgramError = 3;
constexpr unsigned kAlignmentError = 5;
constexpr unsigned kSequenceError = 7;
constexpr unsigned kBusy = 16;
constexpr std::uint32_t kErrors = 0xC3FA;

constexpr unsigned kProgram = 0;
constexpr unsigned kErasePage = 1;
constexpr unsigned kBank2 = 11;
constexpr unsigned kEraseBank2 = 15;  // MER2
constexpr unsigned kStart = 16;
constexpr unsigned kEndInterrupt = 24;    // EOPIE; without it EOP is not set either
constexpr unsigned kErrorInterrupt = 25;  // ERRIE; without it OPERR is not set either. RDERRIE: no area is read-protected
constexpr unsigned kOptionLock = 30;
constexpr unsigned kLock = 31;
constexpr int kLine = 4;  // interrupt of the flash
constexpr unsigned kDoubleError = 31;
constexpr unsigned kCorrectionInterrupt = 24;

}  // namespace flash

Flash::Flash(Machine& machine)
    : RegisterPeripheral(
          {{kAcr, 0x00040600, "ACR", 0x45F0F, "RUN_PD@13"},
           {0x04, 0, "PDKEYR", 0, "PDKEYR@0-31"},
           {flash::kKeyr, 0, "KEYR", kAllBits},
           {0x0C, 0, "OPTKEYR", 0, "OPTKEYR@0-31"},
           {flash::kSr, 0, "SR", kAllBits},
           {flash::kCr, 0xC0000000, "CR", 0xC7018BFB, "MER1@2 OPTSTRT@17 FSTPG@18 OBL_LAUNCH@27 SEC_PROT1@28 SEC_PROT2@29"},
           {flash::kEccr, 0, "ECCR", 0xC0FFFFFF, "ECCCIE@24 ECCC2@28 ECCD2@29"},
           {flash::kOptr, Memory::kUserOptions, "OPTR", 0, "OPTR@0-31"},  // option bytes: factory values, read-only
           {0x24, 0xFFFFFFFF, "PCROP1SR", 0, "PCROP1_STRT@0-14"},
           {0x28, 0xFFFF8000, "PCROP1ER", 0, "PCROP1_END@0-14 PCROP_RDP@31"},
           {0x2C, 0xFF80FFFF, "WRP1AR", 0, "WRP1A_STRT@0-6 WRP1A_END@16-22"},
           {0x30, 0xFF80FFFF, "WRP1BR", 0, "WRP1B_STRT@0-6 WRP1B_END@16-22"},
           {0x44, 0xFFFFFFFF, "PCROP2SR", 0, "PCROP2_STRT@0-14"},
           {0x48, 0xFFFF8000, "PCROP2ER", 0, "PCROP2_END@0-14"},
           {0x4C, 0xFF80FFFF, "WRP2AR", 0, "WRP2A_STRT@0-6 WRP2A_END@16-22"},
           {0x50, 0xFF80FFFF, "WRP2BR", 0, "WRP2B_STRT@0-6 WRP2B_END@16-22"},
           {0x70, 0xFFFEFF00, "SEC1R", 0, "SEC_SIZE1@0-7 BOOT_LOCK@16"},
           {0x74, 0xFFFFFF00, "SEC2R", 0, "SEC_SIZE2@0-7"}}),
      machine_(machine),
      other_bank_(*this, false),
      data_pages_{Bank{*this, true, Memory::kDataPages[0].offset}, Bank{*this, true, Memory::kDataPages[1].offset}},
      finish_(machine.events, [this] { finish(); }),
      interrupt_(machine.events, [this] { std::exchange(on_interrupted_, {})(); }),
      content_(Memory::kBankBytes, 0xFF) {}

bool Flash::is_locked() const { return is_set(registers_[flash::kCr], flash::kLock); }

void Flash::reset() {
    lose_power();  // a reset damages an operation in progress like a power failure
    registers_.reset();
    registers_.at(flash::kOptr) = options_;
    first_word_.reset();
    keys_ = 0;
}

void Flash::set_options(std::uint32_t options) {
    options_ = options;
    registers_.at(flash::kOptr) = options;
    machine_.memory.set_options(options);
}

void Flash::exchange_banks(bool exchanged) {
    if (exchanged == exchanged_) {
        return;
    }
    lose_power();  // by a reset during an operation
    exchanged_ = exchanged;
    std::ranges::swap_ranges(machine_.memory.flash, content_);
    std::swap(damaged_[0], damaged_[1]);
    machine_.cpu.forget_flash();
}

void Flash::check_banks() const {
    fail_if(!is_set(options_, flash::kDualBank),
            "bank 2 is accessed, but option DBANK makes the flash one bank, which is not in this model");
}

void Flash::interrupt_operation(std::uint64_t n, std::function<void()> act) {
    interrupted_operation_ = operations_ + n;
    on_interrupted_ = std::move(act);
}

void Flash::error(unsigned bit) {
    registers_.at(flash::kSr) |= 1U << bit | flag(is_set(registers_[flash::kCr], flash::kErrorInterrupt), flash::kOperationError);
    show_interrupt();
}

void Flash::begin(Operation operation, double duration_s) {
    fail_if(is_set(registers_[kAcr], flash::kDataCache),
            "the flash is erased or programmed with the data cache on, which may corrupt it: clear ACR.DCEN (ES0430 2.2.2)");
    operation_ = operation;
    registers_.at(flash::kSr) |= 1U << flash::kBusy;
    finish_.in(ticks(duration_s));
    if (interrupted_operation_ == operations_) {
        interrupted_operation_.reset();
        interrupt_.in(ticks(0.5 * duration_s));
    }
    ++operations_;
    on_operation();
}

void Flash::finish() {
    const Operation done = *std::exchange(operation_, std::nullopt);
    if (done.words) {
        std::memcpy(content_of(done.runs).data() + done.offset, done.words->data(), sizeof *done.words);
    } else {
        auto& damaged = damaged_of(done.runs);
        std::fill_n(content_of(done.runs).begin() + done.offset, done.erased, 0xFF);
        damaged.erase(damaged.lower_bound(done.offset), damaged.lower_bound(done.offset + done.erased));
    }
    registers_.at(flash::kSr) &= ~(1U << flash::kBusy);
    registers_.at(flash::kSr) |= flag(is_set(registers_[flash::kCr], flash::kEndInterrupt), flash::kEndOfOperation);
    show_interrupt();
}

void Flash::show_interrupt() {
    const std::uint32_t sr = registers_[flash::kSr];
    const std::uint32_t cr = registers_[flash::kCr];
    machine_.nvic.set_level(flash::kLine, (is_set(sr, flash::kEndOfOperation) && is_set(cr, flash::kEndInterrupt)) ||
                                              (is_set(sr, flash::kOperationError) && is_set(cr, flash::kErrorInterrupt)));
}

void Flash::lose_power() {
    if (!operation_) {
        return;
    }
    const Operation cut = *std::exchange(operation_, std::nullopt);
    finish_.cancel();
    interrupt_.cancel();
    auto& damaged = damaged_of(cut.runs);
    if (cut.words) {
        damaged.insert(cut.offset);
        return;
    }
    for (std::uint32_t at = cut.offset; at < cut.offset + cut.erased; at += 16) {  // one double-word erased, the next one damaged
        std::fill_n(content_of(cut.runs).begin() + at, 8, 0xFF);
        damaged.insert(at + 8);
    }
}

std::uint32_t Flash::read_bank(bool runs, std::uint32_t offset) {
    if (!runs) {
        check_banks();
    }
    fail_if(operation_ && operation_->runs == runs, "a bank is read while it is erased or programmed");
    std::uint32_t word = 0;
    std::memcpy(&word, content_of(runs).data() + offset, sizeof word);
    if (damaged_of(runs).contains(offset & ~7U)) {
        report_damage(offset & ~7U);
        machine_.nvic.pend(kNmi);
        word ^= 0x5A5A5A5AU;
    }
    return word;
}

/// ECCR is unreliable after an interrupted operation (ES0430 2.2.3). Here it keeps its content for every other damaged
/// double-word, and names an address of bank 1 for the rest.
void Flash::report_damage(std::uint32_t double_word) {
    if ((double_word & 8U) == 0) {
        return;
    }
    registers_.at(flash::kEccr) =
        (registers_[flash::kEccr] & (1U << flash::kCorrectionInterrupt)) | 1U << flash::kDoubleError | (~double_word & 0x3FFF8U);
}

void Flash::write_bank(bool runs, std::uint32_t offset, std::uint32_t value) {
    if (!runs) {
        check_banks();
    }
    const std::uint32_t place = offset + (runs ? 0 : Memory::kBankBytes);
    fail_if(is_locked() || !is_set(registers_[flash::kCr], flash::kProgram), "store to flash without unlocking and PG");
    fail_if(operation_.has_value(), "the flash is written while it is erased or programmed");
    if (!first_word_) {
        if ((offset & 7U) != 0) {
            error(flash::kAlignmentError);
            return;
        }
        first_word_ = {place, value};
        return;
    }
    const auto [first_place, first_value] = *std::exchange(first_word_, std::nullopt);
    if (place != first_place + 4) {
        error(flash::kAlignmentError);
        return;
    }
    const std::uint32_t first_offset = offset - 4;
    const auto old = std::span(content_of(runs)).subspan(first_offset, 8);
    const bool erased = std::all_of(old.begin(), old.end(), [](std::uint8_t byte) { return byte == 0xFF; });
    if (damaged_of(runs).contains(first_offset) || (!erased && (first_value | value) != 0)) {
        error(flash::kProgramError);
        return;
    }
    if ((registers_[flash::kSr] & flash::kErrors) != 0) {
        error(flash::kSequenceError);
        return;
    }
    begin({runs, first_offset, {{first_value, value}}}, kProgramS);
}

void Flash::unlock(std::uint32_t key) {
    constexpr std::array<std::uint32_t, 2> kKeys{0x45670123, 0xCDEF89AB};
    fail_if(keys_ > 1 || !is_locked() || key != kKeys[static_cast<std::size_t>(keys_)],
            "wrong key: the flash stays locked until the next reset");
    if (++keys_ == 2) {
        keys_ = 0;
        registers_.at(flash::kCr) &= ~(1U << flash::kLock);
    }
}

void Flash::control(std::uint32_t value) {
    fail_if(operation_.has_value(), "CR is written while the flash is busy");
    fail_if(is_locked(), "CR is written while the flash is locked");
    registers_.at(flash::kCr) = (value & ~(1U << flash::kStart)) | (registers_[flash::kCr] & 1U << flash::kOptionLock);
    show_interrupt();
    if (!is_set(value, flash::kStart)) {
        return;
    }
    if (is_set(value, flash::kErasePage) == is_set(value, flash::kEraseBank2) || is_set(value, flash::kProgram) ||
        (registers_[flash::kSr] & flash::kErrors) != 0) {
        error(flash::kSequenceError);
        return;
    }
    if (is_set(value, flash::kEraseBank2)) {
        fail_if(exchanged_, "erase of bank 2, which holds the running code");
        begin({false, 0, std::nullopt, Memory::kBankBytes}, kEraseS);
        return;
    }
    const std::uint32_t page = field(value, 3, 7) * kPageBytes;
    const bool runs = is_set(value, flash::kBank2) == exchanged_;  // BKER names the bank itself (ST's HAL for the STM32G4)
    const bool has_data =
        std::ranges::any_of(Memory::kDataPages, [&](const auto& part) { return page - part.offset < part.bytes; });
    fail_if(runs && !has_data, "erase of a page of the bank that runs, which may hold the running code");
    begin({runs, page, std::nullopt}, kEraseS);
}

void Flash::apply(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case flash::kKeyr:
            unlock(value);
            break;
        case flash::kSr:
            registers_.at(flash::kSr) &= ~(value & (flash::kErrors | 1U));
            show_interrupt();
            break;
        case flash::kCr:
            control(value);
            break;
        case flash::kEccr: {
            const bool cleared = is_set(value, flash::kDoubleError);
            registers_.at(flash::kEccr) = cleared ? value & (1U << flash::kCorrectionInterrupt) : registers_[flash::kEccr];
            break;
        }
        case kAcr:
            registers_.at(kAcr) = value;
            break;
        default:
            throw RunFailure("option bytes are read-only in this model");
    }
}

}  // namespace tricoil::virtual_board
