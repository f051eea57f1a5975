// Where a board keeps its calibration: two slots, of which one is always whole.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/calibration/blob.hpp"
#include "hal/storage.hpp"

namespace tricoil::app {

/// A record is a head (what it is, its number), the blob, and a CRC-32 of both that is written last. A new record goes into the
/// slot that does not hold the newest: power may fail at any moment, and what is read then is the old blob or the new one.
class CalibrationStore {
public:
    static constexpr std::size_t kSlots = 2;
    static constexpr std::size_t kRecordBytes = 512;  // of a slot
    static_assert(calibration::kBlobBytes + 2 * hal::Storage::kWordBytes <= kRecordBytes);

    explicit CalibrationStore(hal::Storage& storage) : storage_(storage) {}

    enum class Content : std::uint8_t {
        none,     // never written
        sound,    // read() has it
        damaged,  // something, and no record is whole
    };
    /// Looks at both slots.
    Content open();

    /// The newest whole record's blob. ok; not_ready: there is none; degenerate: it has been damaged since open().
    Status read(calibration::Blob& blob);

    /// Keeps `blob` from now on; coils must be off. ok, and the old one is given up; or the errors of Storage, invalid_argument
    /// if there are no two slots for it, degenerate if it reads back as something else: then the old one is still there.
    Status write(const calibration::Blob& blob);

private:
    /// What stands in front of a blob.
    struct Head {
        std::uint32_t magic = 0;
        std::uint32_t sequence = 0;
    };
    struct Look {
        bool is_erased = true;
        std::optional<std::uint32_t> sequence;  // of a whole record
    };
    Look look(std::size_t slot);
    Status write_record(std::size_t slot, Head head, const calibration::Blob& blob);

    hal::Storage& storage_;
    std::optional<std::size_t> newest_;  // slot of the record that read() has
    std::uint32_t sequence_ = 0;         // of that record
};

}  // namespace tricoil::app
