#include "sim/virtual_board/peripherals/flash.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace tricoil::virtual_board {
namespace flash {

constexpr std::uint32_t kKeyr = 0x08;
constexpr std::uint32_t kOptKeyr = 0x0C;
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
constexpr unsigned kFast = 18;            // FSTPG
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
           {flash::kOptKeyr, 0, "OPTKEYR", kAllBits},
           {flash::kSr, 0, "SR", kAllBits},
           {flash::kCr, 0xC0000000, "CR", 0xC7058BFB, "MER1@2 OPTSTRT@17 OBL_LAUNCH@27 SEC_PROT1@28 SEC_PROT2@29"},
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
      content_(Memory::kBankBytes, 0xFF) {
    machine_.cpu.on_flash_write = [this](std::uint32_t offset, std::uint32_t value) {
        const bool programs = !is_locked() && (registers_[flash::kCr] & (1U << flash::kProgram | 1U << flash::kFast)) != 0;
        if (programs) {
            write_bank(true, offset, value);
        }
        return programs;
    };
}

bool Flash::is_locked() const { return is_set(registers_[flash::kCr], flash::kLock); }

void Flash::reset() {
    lose_power();  // a reset damages an operation in progress like a power failure
    registers_.reset();
    registers_.at(flash::kOptr) = options_;
    words_.clear();
    keys_ = 0;
    option_keys_ = 0;
    is_mass_erased_ = false;
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
    machine_.cpu.forget_flash(0, Memory::kBankBytes);
}

void Flash::check_bank(bool runs) const {
    fail_if(!runs && !is_set(options_, flash::kDualBank),
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
    if (operation_->runs && holds_code(operation_->offset)) {
        machine_.cpu.wait(ticks(duration_s));
    }
}

bool Flash::holds_code(std::uint32_t offset) const {
    const auto holds = [offset](const auto& part) { return offset - part.offset < part.bytes; };
    return !has_data_pages_ || std::ranges::none_of(Memory::kDataPages, holds);
}

void Flash::finish() {
    const Operation done = *std::exchange(operation_, std::nullopt);
    if (!done.words.empty()) {
        std::memcpy(content_of(done.runs).data() + done.offset, done.words.data(), 4 * done.words.size());
    } else {
        auto& damaged = damaged_of(done.runs);
        std::fill_n(content_of(done.runs).begin() + done.offset, done.erased, 0xFF);
        damaged.erase(damaged.lower_bound(done.offset), damaged.lower_bound(done.offset + done.erased));
    }
    if (done.runs && holds_code(done.offset)) {
        machine_.cpu.forget_flash(done.offset,
                                  done.words.empty() ? done.erased : static_cast<std::uint32_t>(4 * done.words.size()));
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
    if (!cut.words.empty()) {
        for (std::uint32_t at = 0; at < 4 * cut.words.size(); at += 8) {
            damaged.insert(cut.offset + at);
        }
        return;
    }
    for (std::uint32_t at = cut.offset; at < cut.offset + cut.erased; at += 16) {  // one double-word erased, the next one damaged
        std::fill_n(content_of(cut.runs).begin() + at, 8, 0xFF);
        damaged.insert(at + 8);
    }
}

std::uint32_t Flash::read_bank(bool runs, std::uint32_t offset) {
    check_bank(runs);
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
    check_bank(runs);
    const std::uint32_t place = offset + (runs ? 0 : Memory::kBankBytes);
    const bool fast = is_set(registers_[flash::kCr], flash::kFast);
    fail_if(is_locked() || (!fast && !is_set(registers_[flash::kCr], flash::kProgram)),
            "store to flash without unlocking and PG");
    fail_if(operation_.has_value(), "the flash is written while it is erased or programmed");
    const std::uint32_t bytes = fast ? kRowBytes : 8;
    if (words_.empty()) {
        first_place_ = place;
    }
    const auto written = static_cast<std::uint32_t>(4 * words_.size());
    if (first_place_ % bytes != 0 || place != first_place_ + written) {
        words_.clear();
        error(flash::kAlignmentError);
        return;
    }
    words_.push_back(value);
    if (written + 4 < bytes) {
        return;
    }
    const std::vector<std::uint32_t> words = std::exchange(words_, {});
    const std::uint32_t first = offset - written;
    fail_if(runs && has_data_pages_ && holds_code(first), "a store to the running code of a tracker board");
    const auto old = std::span(content_of(runs)).subspan(first, bytes);
    const bool erased = std::ranges::all_of(old, [](std::uint8_t byte) { return byte == 0xFF; });
    const bool clears = std::ranges::all_of(words, [](std::uint32_t word) { return word == 0; });
    const auto& damaged = damaged_of(runs);
    if (damaged.lower_bound(first) != damaged.lower_bound(first + bytes) || (!erased && !clears)) {
        error(flash::kProgramError);
        return;
    }
    // A row needs a mass erase of its bank before; this model has only that of bank 2.
    if ((registers_[flash::kSr] & flash::kErrors) != 0 || (fast && (runs || !is_mass_erased_))) {
        error(flash::kSequenceError);
        return;
    }
    begin({runs, first, words}, fast ? kProgramRowS : kProgramS);
}

void Flash::unlock(std::uint32_t key, int& keys, std::array<std::uint32_t, 2> right, unsigned lock) {
    fail_if(keys > 1 || !is_set(registers_[flash::kCr], lock) || key != right[static_cast<std::size_t>(keys)],
            "wrong key: the flash stays locked until the next reset");
    if (++keys == 2) {
        keys = 0;
        registers_.at(flash::kCr) &= ~(1U << lock);
    }
}

void Flash::control(std::uint32_t value) {
    fail_if(operation_.has_value(), "CR is written while the flash is busy");
    fail_if(is_locked(), "CR is written while the flash is locked");
    if (((value ^ registers_[flash::kCr]) & (1U << flash::kProgram | 1U << flash::kFast)) != 0) {
        words_.clear();
    }
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
        is_mass_erased_ = true;
        begin({false, 0, {}, Memory::kBankBytes}, kEraseS);
        return;
    }
    const std::uint32_t page = field(value, 3, 7) * kPageBytes;
    const bool runs = is_set(value, flash::kBank2) == exchanged_;  // BKER names the bank itself (ST's HAL for the STM32G4)
    fail_if(runs && has_data_pages_ && holds_code(page), "erase of a page of the running code of a tracker board");
    begin({runs, page, {}}, kEraseS);
}

void Flash::apply(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case flash::kKeyr:
            unlock(value, keys_, {0x45670123, 0xCDEF89AB}, flash::kLock);
            break;
        case flash::kOptKeyr:
            fail_if(is_locked(), "an option key is written while the flash is locked");
            unlock(value, option_keys_, {0x08192A3B, 0x4C5D6E7F}, flash::kOptionLock);
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
