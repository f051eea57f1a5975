// Memory that keeps what is written while the power is off: what a board remembers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/status.hpp"

namespace tricoil::hal {

/// Slots that are erased as a whole and programmed once after that, one double-word at a time. Power may fail within any of
/// these: the double-word, or the slot, that was being changed may then read as anything, or not at all; all others keep what
/// they held.
class Storage {
public:
    /// What is programmed at once; offsets are multiples of it.
    static constexpr std::size_t kWordBytes = 8;

    Storage() = default;
    Storage(const Storage&) = delete;
    Storage& operator=(const Storage&) = delete;
    virtual ~Storage() = default;

    [[nodiscard]] std::size_t slots() const { return do_slots(); }
    [[nodiscard]] std::size_t slot_bytes() const { return do_slot_bytes(); }

    /// Erases one slot. Thread context, coils off: the processor may stand still for tens of milliseconds.
    /// ok; invalid_argument: no such slot; timed_out or device_lost: it did not work, the slot holds anything.
    Status erase(std::size_t slot) { return do_erase(slot); }

    /// Programs one double-word, its first byte at the lowest address. Thread context, coils off.
    /// ok; invalid_argument: no such place; timed_out or device_lost: it did not work (not erased before, protected, worn out).
    Status program(std::size_t slot, std::size_t offset, std::uint64_t word) { return do_program(slot, offset, word); }

    /// Reads `to.size()` bytes, a whole number of double-words, from a multiple of kWordBytes.
    /// ok; invalid_argument: no such place; degenerate: a double-word in there was damaged and cannot be read, `to` holds
    /// anything.
    Status read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) { return do_read(slot, offset, to); }

private:
    [[nodiscard]] virtual std::size_t do_slots() const = 0;
    [[nodiscard]] virtual std::size_t do_slot_bytes() const = 0;
    virtual Status do_erase(std::size_t slot) = 0;
    virtual Status do_program(std::size_t slot, std::size_t offset, std::uint64_t word) = 0;
    virtual Status do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) = 0;
};

}  // namespace tricoil::hal
