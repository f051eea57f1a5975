#include "board/stm32g4/image_bank.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "board/stm32g4/image_check.hpp"
#include "board/stm32g4/image_header.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "drivers/stm32g4/registers/syscfg.hpp"

namespace tricoil::stm32g4_board {
namespace {

using namespace stm32g4;

constexpr std::uintptr_t kOtherBank = kFlash + kFlashBankBytes;
constexpr std::size_t kHeaderAt = kImageHeaderOffset - kProgramOffset;
constexpr std::size_t kWordBytes = hal::Storage::kWordBytes;

std::uint64_t entry(bool bank_2) { return kBankEntry[bank_2 ? 1 : 0] | std::uint64_t{~kBankEntry[bank_2 ? 1 : 0]} << 32U; }

}  // namespace

bool runs_bank_2() { return (peripheral<SyscfgRegisters>(kSyscfgBase).MEMRMP & syscfg::MEMRMP_FB_MODE) != 0; }

FlashStorage::Pages pages_of(bool bank_2, std::uint8_t first, std::uint8_t count) {
    const std::uintptr_t bank = bank_2 == runs_bank_2() ? kFlash : kOtherBank;
    return {&peripheral<volatile std::uint64_t>(bank + first * kFlashPageBytes), first, count, bank_2};
}

FlashImageBank::FlashImageBank(FlashRegisters& registers, Processor& processor)
    : processor_(processor),
      image_(registers, pages_of(!runs_bank_2(), kFirstProgramPage, kFirstStoragePage - kFirstProgramPage)),
      log_(registers, pages_of(false, kLogPage, 1)) {}

void FlashImageBank::begin() {
    bool confirmed_bank_2 = false;
    for (next_entry_ = 0; next_entry_ < kLogEntries; ++next_entry_) {
        std::array<std::uint8_t, kWordBytes> bytes{};
        const bool is_sound = log_.read(0, next_entry_ * kWordBytes, bytes).ok();
        const auto word = std::bit_cast<std::uint64_t>(bytes);
        if (is_sound && word == ~std::uint64_t{0}) {
            break;
        }
        confirmed_bank_2 = word == entry(true) || (confirmed_bank_2 && word != entry(false));
    }
    is_on_trial_ = confirmed_bank_2 != runs_bank_2();
}

/// Checks the header: an image for this board, and for the selector that is there.
bool FlashImageBank::start_image(std::span<const std::uint8_t> part) {
    if (part.size() < kHeaderAt + sizeof(ImageHeader)) {
        return false;
    }
    ImageHeader header;
    std::memcpy(&header, part.data() + kHeaderAt, sizeof header);
    std::array<std::uint32_t, 2> vectors{};
    std::memcpy(vectors.data(), part.data(), sizeof vectors);
    const auto end = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(header.image_end));
    if (header.magic != image_header.magic || header.header_version != image_header.header_version ||
        header.board != image_header.board || header.boot_record != image_header.boot_record || !has_plausible_end(end) ||
        !is_program(vectors[0], vectors[1])) {
        return false;
    }
    size_ = 0;
    is_sound_ = false;
    whole_ = end - kFlash - kProgramOffset;
    return true;
}

Status FlashImageBank::do_write(std::uint32_t offset, std::span<const std::uint8_t> part) {
    if (next_entry_ == kLogEntries) {
        return {StatusCode::device_lost, "the log of the banks is full; write the image with a programmer"};
    }
    if (offset == 0 && !start_image(part)) {
        return {StatusCode::invalid_argument, "not an image for this board"};
    }
    if (offset != size_ || size_ >= whole_) {
        return {StatusCode::not_ready, "not the next part of the image"};
    }
    part = part.first(std::min<std::size_t>(part.size(), whole_ - size_));
    for (std::size_t at = 0; at < part.size(); at += kWordBytes) {
        std::uint64_t word = ~std::uint64_t{0};
        std::memcpy(&word, part.data() + at, std::min(part.size() - at, kWordBytes));
        if (const Status status = program(offset + static_cast<std::uint32_t>(at), word); !status.ok()) {
            whole_ = 0;  // a new image must begin
            return status;
        }
    }
    size_ += static_cast<std::uint32_t>(part.size());
    return size_ == whole_ ? complete() : Status{};
}

Status FlashImageBank::program(std::uint32_t at, std::uint64_t word) {
    const std::size_t page = at / kFlashPageBytes;
    if (at % kFlashPageBytes == 0) {
        if (const Status erased = image_.erase(page); !erased.ok()) {
            return erased;
        }
    }
    if (at == 0) {
        first_word_ = word;
        return {};
    }
    return image_.program(page, at % kFlashPageBytes, word);
}

Status FlashImageBank::complete() {
    const Status status = image_.program(0, 0, first_word_);
    is_sound_ = status.ok() && check_image(kOtherBank).is_sound;
    if (is_sound_) {
        return {};
    }
    (void)image_.erase(0);
    return status.ok() ? Status{StatusCode::degenerate, "the image was damaged on its way"} : status;
}

void FlashImageBank::do_restart(bool on_trial) { processor_.restart(on_trial ? BootRecord::kTryOtherBank : 0); }

/// A place that reads as erased but cannot be programmed is filled with zeros, which is always possible.
Status FlashImageBank::do_confirm() {
    for (; next_entry_ < kLogEntries; ++next_entry_) {
        if (log_.program(0, next_entry_ * kWordBytes, entry(runs_bank_2())).ok()) {
            ++next_entry_;
            is_on_trial_ = false;
            return {};
        }
        (void)log_.program(0, next_entry_ * kWordBytes, 0);
    }
    return {StatusCode::device_lost, "the log of the banks is full"};
}

}  // namespace tricoil::stm32g4_board
