#include "board/app/calibration_store.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "core/base/crc32.hpp"

namespace tricoil::app {
namespace {

using hal::Storage;
using Word = std::array<std::uint8_t, Storage::kWordBytes>;

constexpr std::uint32_t kMagic = 0x534C4143;  // "CALS", little-endian
constexpr std::size_t kBlobAt = Storage::kWordBytes;
constexpr std::size_t kBlobWords = (calibration::kBlobBytes + Storage::kWordBytes - 1) / Storage::kWordBytes;
constexpr std::size_t kTailAt = kBlobAt + kBlobWords * Storage::kWordBytes;

static_assert(std::endian::native == std::endian::little, "records are little-endian");

std::uint64_t word_of(std::uint32_t low, std::uint32_t high) { return low | static_cast<std::uint64_t>(high) << 32U; }

/// Word n of a blob, padded with zeros.
Word blob_word(const calibration::Blob& blob, std::size_t n) {
    Word word{};
    const std::size_t first = n * Storage::kWordBytes;
    std::copy_n(blob.begin() + static_cast<std::ptrdiff_t>(first), std::min(word.size(), blob.size() - first), word.begin());
    return word;
}

}  // namespace

CalibrationStore::Content CalibrationStore::open() {
    newest_.reset();
    bool is_erased = true;
    for (std::size_t slot = 0; slot < kSlots; ++slot) {
        const SlotContent found = inspect(slot);
        is_erased = is_erased && found.is_erased;
        const bool is_newer = found.sequence && (!newest_ || static_cast<std::int32_t>(*found.sequence - sequence_) > 0);
        if (is_newer) {
            newest_ = slot;
            sequence_ = *found.sequence;
        }
    }
    return newest_ ? Content::sound : (is_erased ? Content::none : Content::damaged);
}

auto CalibrationStore::inspect(std::size_t slot) -> SlotContent {
    SlotContent found;
    std::uint32_t crc = 0;
    Word word{};
    bool is_whole = true;
    std::uint64_t head = 0;
    for (std::size_t at = 0; at <= kTailAt; at += Storage::kWordBytes) {
        if (!storage_.read(slot, at, word).ok()) {
            return {false, std::nullopt};
        }
        const auto value = std::bit_cast<std::uint64_t>(word);
        found.is_erased = found.is_erased && value == ~std::uint64_t{0};
        if (at == 0) {
            head = value;
        }
        if (at < kTailAt) {
            crc = crc32_continued(crc, word);
        } else {
            is_whole = value == word_of(crc, ~crc);
        }
    }
    if (is_whole && static_cast<std::uint32_t>(head) == kMagic) {
        found.sequence = static_cast<std::uint32_t>(head >> 32U);
    }
    return found;
}

Status CalibrationStore::read(calibration::Blob& blob) {
    if (!newest_) {
        return {StatusCode::not_ready, "no calibration is stored"};
    }
    for (std::size_t n = 0; n < kBlobWords; ++n) {
        Word word{};
        if (const Status status = storage_.read(*newest_, kBlobAt + n * Storage::kWordBytes, word); !status.ok()) {
            return status;
        }
        const std::size_t first = n * Storage::kWordBytes;
        std::copy_n(word.begin(), std::min(word.size(), blob.size() - first), blob.begin() + static_cast<std::ptrdiff_t>(first));
    }
    return {};
}

Status CalibrationStore::write(const calibration::Blob& blob) {
    if (storage_.slots() < kSlots || storage_.slot_bytes() < kRecordBytes) {
        return {StatusCode::invalid_argument, "the storage is too small for two calibrations"};
    }
    const std::size_t slot = newest_ ? 1 - *newest_ : 0;
    const Head head{kMagic, newest_ ? sequence_ + 1 : 0};
    if (const Status written = write_record(slot, head, blob); !written.ok()) {
        return written;
    }
    const SlotContent found = inspect(slot);
    if (found.sequence != head.sequence) {
        return {StatusCode::degenerate, "the stored calibration differs from the written one"};
    }
    newest_ = slot;
    sequence_ = head.sequence;
    return {};
}

Status CalibrationStore::write_record(std::size_t slot, Head head, const calibration::Blob& blob) {
    if (const Status erased = storage_.erase(slot); !erased.ok()) {
        return erased;
    }
    std::uint32_t crc = 0;
    const auto put = [&](std::size_t at, std::uint64_t value) {
        crc = crc32_continued(crc, std::bit_cast<Word>(value));
        return storage_.program(slot, at, value);
    };
    Status status = put(0, word_of(head.magic, head.sequence));
    for (std::size_t n = 0; n < kBlobWords && status.ok(); ++n) {
        status = put(kBlobAt + n * Storage::kWordBytes, std::bit_cast<std::uint64_t>(blob_word(blob, n)));
    }
    return status.ok() ? storage_.program(slot, kTailAt, word_of(crc, ~crc)) : status;
}

}  // namespace tricoil::app
