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

static_assert(std::endian::native == std::endian::little, "records are little-endian");

std::uint64_t word_of(std::uint32_t low, std::uint32_t high) { return low | static_cast<std::uint64_t>(high) << 32U; }

static_assert(Storage::kWordBytes == calibration::kBlobHeaderBytes, "the first word of a blob gives its length");

/// Place of the last word of a record, from the first word of its blob.
std::size_t tail_at(const Word& header) {
    return kBlobAt + (calibration::blob_bytes(header) + Storage::kWordBytes - 1) / Storage::kWordBytes * Storage::kWordBytes;
}

/// Word at `first` of a blob, padded with zeros.
Word blob_word(const calibration::Blob& blob, std::size_t first) {
    Word word{};
    for (std::size_t k = 0; k < word.size() && first + k < blob.size(); ++k) {
        word[k] = blob[first + k];
    }
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
    for (std::size_t at = 0, tail = kBlobAt + 1; at <= tail; at += Storage::kWordBytes) {
        if (!storage_.read(first_ + slot, at, word).ok()) {
            return {false, std::nullopt};
        }
        const auto value = std::bit_cast<std::uint64_t>(word);
        found.is_erased = found.is_erased && value == ~std::uint64_t{0};
        if (at == 0) {
            head = value;
        } else if (at == kBlobAt) {
            tail = tail_at(word);
        }
        if (at < tail) {
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
    blob = {};
    std::size_t bytes = calibration::kBlobHeaderBytes;
    for (std::size_t first = 0; first < bytes; first += Storage::kWordBytes) {
        Word word{};
        if (const Status status = storage_.read(first_ + *newest_, kBlobAt + first, word); !status.ok()) {
            return status;
        }
        bytes = first == 0 ? calibration::blob_bytes(word) : bytes;
        for (std::size_t k = 0; k < word.size() && blob.size() < bytes; ++k) {
            (void)blob.push_back(word[k]);
        }
    }
    return {};
}

Status CalibrationStore::write(const calibration::Blob& blob) {
    if (storage_.slots() < first_ + kSlots || storage_.slot_bytes() < kRecordBytes) {
        return {StatusCode::invalid_argument, "the storage is too small for two calibrations"};
    }
    const std::size_t slot = newest_ ? 1 - *newest_ : 0;
    const Head head{kMagic, newest_ ? sequence_ + 1 : 0};
    if (const Status written = write_record(first_ + slot, head, blob); !written.ok()) {
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
    const std::size_t tail = tail_at(blob_word(blob, 0));
    for (std::size_t at = kBlobAt; at < tail && status.ok(); at += Storage::kWordBytes) {
        status = put(at, std::bit_cast<std::uint64_t>(blob_word(blob, at - kBlobAt)));
    }
    return status.ok() ? storage_.program(slot, tail, word_of(crc, ~crc)) : status;
}

}  // namespace tricoil::app
