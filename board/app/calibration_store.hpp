// Calibration in flash: two slots, at least one of which holds a complete record after the first write.
#pragma once

#include <cstdint>
#include <optional>

#include "core/calibration/blob.hpp"
#include "hal/storage.hpp"

namespace tricoil::app {

/// A record is a head (magic, sequence number), the blob, and a CRC-32 of both that is written last. A new record goes into the
/// slot that does not hold the newest. If power fails during a write, the old or the new blob is read.
class CalibrationStore {
public:
    static constexpr std::size_t kSlots = 2;
    static constexpr std::size_t kRecordBytes = 616;  // smallest size of a slot
    static_assert(calibration::kMaxBlobBytes + 2 * hal::Storage::kWordBytes <= kRecordBytes);

    explicit CalibrationStore(hal::Storage& storage) : storage_(storage) {}

    enum class Content : std::uint8_t {
        none,     // never written
        sound,    // read() returns it
        damaged,  // data are present, but no record is complete
    };
    /// Reads both slots.
    Content open();

    /// Blob of the newest complete record. Errors: not_ready (no calibration); degenerate (damaged since open()).
    Status read(calibration::Blob& blob);

    /// Stores `blob` in place of the old one; coils must be off. Errors: those of Storage, invalid_argument (fewer than two
    /// slots, or slots that are too small), degenerate (read back differently). After an error the old blob is still valid.
    Status write(const calibration::Blob& blob);

private:
    /// Start of a record.
    struct Head {
        std::uint32_t magic = 0;
        std::uint32_t sequence = 0;
    };
    struct SlotContent {
        bool is_erased = true;
        std::optional<std::uint32_t> sequence;  // of a complete record
    };
    SlotContent inspect(std::size_t slot);
    Status write_record(std::size_t slot, Head head, const calibration::Blob& blob);

    hal::Storage& storage_;
    std::optional<std::size_t> newest_;  // slot of the newest complete record
    std::uint32_t sequence_ = 0;         // of that record
};

}  // namespace tricoil::app
