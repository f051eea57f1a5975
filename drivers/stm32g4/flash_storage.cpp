#include "drivers/stm32g4/flash_storage.hpp"

#include <cstring>

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr std::uint32_t kBusyPolls = 4'000'000;  // a page takes 22 ms at most to erase (DS12288), and an asking 10 ns at least
constexpr Status kNoSuchPlace{StatusCode::invalid_argument, "no such place in the storage"};
constexpr Status kOneBank{StatusCode::device_lost, "the flash is set up as one bank; set DBANK in its option bytes"};
constexpr std::uint32_t kBankBytes = 256 * 1024;

}  // namespace

Status FlashStorage::do_erase(std::size_t slot) {
    if (!holds(slot, 0, kFlashPageBytes)) {
        return kNoSuchPlace;
    }
    if (const Status unlocked = unlock(); !unlocked.ok()) {
        return unlocked;
    }
    const auto page = static_cast<std::uint32_t>(pages_.first + slot);
    registers_.CR = flash::CR_PER | flash::CR_BKER | page << flash::CR_PNB_Pos;
    registers_.CR = flash::CR_PER | flash::CR_BKER | page << flash::CR_PNB_Pos | flash::CR_STRT;
    return finish();
}

Status FlashStorage::do_program(std::size_t slot, std::size_t offset, std::uint64_t word) {
    if (!holds(slot, offset, kWordBytes)) {
        return kNoSuchPlace;
    }
    if (const Status unlocked = unlock(); !unlocked.ok()) {
        return unlocked;
    }
    registers_.CR = flash::CR_PG;
    auto* const halves = reinterpret_cast<volatile std::uint32_t*>(word_at(slot, offset));
    halves[0] = static_cast<std::uint32_t>(word);
    halves[1] = static_cast<std::uint32_t>(word >> 32U);
    return finish();
}

Status FlashStorage::do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) {
    if (!holds(slot, offset, to.size())) {
        return kNoSuchPlace;
    }
    if (!has_two_banks()) {
        return kOneBank;
    }
    is_damaged_ = false;
    const volatile std::uint64_t* from = word_at(slot, offset);
    for (std::size_t at = 0; at < to.size(); at += kWordBytes) {
        const std::uint64_t word = *from++;
        std::memcpy(to.data() + at, &word, kWordBytes);
    }
    return is_damaged_ ? Status{StatusCode::degenerate, "a double-word of the storage is damaged"} : Status{};
}

bool FlashStorage::on_ecc_error() {
    const std::uint32_t error = registers_.ECCR;
    if ((error & flash::ECCR_ECCD) == 0) {
        return false;
    }
    registers_.ECCR = flash::ECCR_ECCD;
    const std::uint32_t page = (error & flash::ECCR_ADDR_ECC) % kBankBytes / kFlashPageBytes;
    const bool ours =
        (error & flash::ECCR_BK_ECC) != 0 && page >= pages_.first && page < std::uint32_t{pages_.first} + pages_.count;
    is_damaged_ = is_damaged_ || ours;
    return ours;
}

/// As one bank its pages are twice as large, and a page number means another place: both slots would be one page.
bool FlashStorage::has_two_banks() const { return (registers_.OPTR & flash::OPTR_DBANK) != 0; }

Status FlashStorage::unlock() {
    if (!has_two_banks()) {
        return kOneBank;
    }
    const Status idle = wait_until([this] { return (registers_.SR & flash::SR_BSY) == 0; }, kBusyPolls, "the flash stays busy");
    if (!idle.ok()) {
        return idle;
    }
    take_errors();  // one that is left over would refuse everything
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
    forget_cached();
    if (!done.ok()) {
        return done;
    }
    return errors == 0 ? Status{} : Status{StatusCode::device_lost, "the flash refuses: not erased, protected or worn out"};
}

std::uint32_t FlashStorage::take_errors() {
    const std::uint32_t errors = registers_.SR & flash::SR_ERRORS;
    if (errors != 0) {
        registers_.SR = errors;
    }
    return errors;
}

/// The data cache would go on showing what was there before; it can be emptied only while it is off.
void FlashStorage::forget_cached() {
    const std::uint32_t before = registers_.ACR;
    registers_.ACR = before & ~flash::ACR_DCEN;
    registers_.ACR = (before & ~flash::ACR_DCEN) | flash::ACR_DCRST;
    registers_.ACR = before & ~flash::ACR_DCEN;
    registers_.ACR = before;
}

bool FlashStorage::holds(std::size_t slot, std::size_t offset, std::size_t bytes) const {
    return slot < pages_.count && offset % kWordBytes == 0 && bytes % kWordBytes == 0 && bytes <= kFlashPageBytes &&
           offset <= kFlashPageBytes - bytes;
}

volatile std::uint64_t* FlashStorage::word_at(std::size_t slot, std::size_t offset) const {
    return pages_.memory + (slot * kFlashPageBytes + offset) / kWordBytes;
}

}  // namespace tricoil::stm32g4
