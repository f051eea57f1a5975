#include "drivers/stm32g4/flash_storage.hpp"

#include <cstring>

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr std::uint32_t kBusyPolls = 4'000'000;  // a page erase takes at most 22 ms (DS12288), and one poll at least 10 ns
constexpr Status kInvalidAddress{StatusCode::invalid_argument, "address outside the storage"};
constexpr Status kOneBank{StatusCode::device_lost, "the flash is configured as one bank; set DBANK in its option bytes"};

}  // namespace

Status FlashStorage::do_erase(std::size_t slot) {
    if (!is_valid_range(slot, 0, kFlashPageBytes)) {
        return kInvalidAddress;
    }
    if (const Status unlocked = unlock(); !unlocked.ok()) {
        return unlocked;
    }
    switch_data_cache_off();
    const std::uint32_t bank = pages_.in_bank_2 ? flash::CR_BKER : 0;  // also with exchanged banks: the bank itself
    const auto page = static_cast<std::uint32_t>(pages_.first + slot);
    registers_.CR = flash::CR_PER | bank | page << flash::CR_PNB_Pos;
    registers_.CR = flash::CR_PER | bank | page << flash::CR_PNB_Pos | flash::CR_STRT;
    return finish();
}

Status FlashStorage::do_program(std::size_t slot, std::size_t offset, std::uint64_t word) {
    if (!is_valid_range(slot, offset, kWordBytes)) {
        return kInvalidAddress;
    }
    if (const Status unlocked = unlock(); !unlocked.ok()) {
        return unlocked;
    }
    switch_data_cache_off();
    registers_.CR = flash::CR_PG;
    auto* const halves = reinterpret_cast<volatile std::uint32_t*>(word_at(slot, offset));
    halves[0] = static_cast<std::uint32_t>(word);
    halves[1] = static_cast<std::uint32_t>(word >> 32U);
    return finish();
}

Status FlashStorage::do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) {
    if (!is_valid_range(slot, offset, to.size())) {
        return kInvalidAddress;
    }
    if (!has_two_banks()) {
        return kOneBank;
    }
    is_damaged_ = false;
    is_reading_ = true;
    const volatile std::uint64_t* from = word_at(slot, offset);
    for (std::size_t at = 0; at < to.size(); at += kWordBytes) {
        const std::uint64_t word = *from++;
        std::memcpy(to.data() + at, &word, kWordBytes);
    }
    is_reading_ = false;
    return is_damaged_ ? Status{StatusCode::degenerate, "a double-word of the storage is damaged"} : Status{};
}

bool FlashStorage::on_ecc_error() {
    registers_.ECCR = flash::ECCR_ECCD;
    is_damaged_ = is_damaged_ || is_reading_;
    return is_reading_;
}

/// In single-bank mode pages are twice as large and page numbers have other addresses: two slots would be in one page.
bool FlashStorage::has_two_banks() const { return (registers_.OPTR & flash::OPTR_DBANK) != 0; }

Status FlashStorage::unlock() {
    if (!has_two_banks()) {
        return kOneBank;
    }
    const Status idle = wait_until([this] { return (registers_.SR & flash::SR_BSY) == 0; }, kBusyPolls, "the flash stays busy");
    if (!idle.ok()) {
        return idle;
    }
    take_errors();  // an error flag of an earlier operation would make every operation fail
    if ((registers_.CR & flash::CR_LOCK) != 0) {
        registers_.KEYR = flash::KEYR_KEY1;
        registers_.KEYR = flash::KEYR_KEY2;
    }
    return (registers_.CR & flash::CR_LOCK) == 0 ? Status{}
                                                 : Status{StatusCode::device_lost, "the flash stays locked until the next reset"};
}

Status FlashStorage::finish() {
    const Status done = wait_until([this] { return (registers_.SR & flash::SR_BSY) == 0; }, kBusyPolls, "the flash stays busy");
    const std::uint32_t errors = take_errors();
    registers_.CR = flash::CR_LOCK;
    restore_data_cache();
    if (!done.ok()) {
        return done;
    }
    return errors == 0 ? Status{} : Status{StatusCode::device_lost, "flash operation failed: not erased, protected or worn out"};
}

std::uint32_t FlashStorage::take_errors() {
    const std::uint32_t errors = registers_.SR & flash::SR_ERRORS;
    if (errors != 0) {
        registers_.SR = errors;
    }
    return errors;
}

/// While bank 2 is erased or programmed, a read of bank 1 may corrupt the data cache (ES0430 2.2.2). The cache is off
/// during these operations.
void FlashStorage::switch_data_cache_off() {
    data_cache_ = registers_.ACR & flash::ACR_DCEN;
    registers_.ACR = registers_.ACR & ~flash::ACR_DCEN;
}

/// Resets the data cache, which still holds the old content. The reset is possible only while the cache is off.
void FlashStorage::restore_data_cache() {
    const std::uint32_t off = registers_.ACR;
    registers_.ACR = off | flash::ACR_DCRST;
    registers_.ACR = off;
    registers_.ACR = off | data_cache_;
}

bool FlashStorage::is_valid_range(std::size_t slot, std::size_t offset, std::size_t bytes) const {
    return slot < pages_.count && offset % kWordBytes == 0 && bytes % kWordBytes == 0 && bytes <= kFlashPageBytes &&
           offset <= kFlashPageBytes - bytes;
}

volatile std::uint64_t* FlashStorage::word_at(std::size_t slot, std::size_t offset) const {
    return pages_.memory + (slot * kFlashPageBytes + offset) / kWordBytes;
}

}  // namespace tricoil::stm32g4
