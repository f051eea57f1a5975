// Non-volatile memory for the settings of a board.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/interface.hpp"
#include "core/base/status.hpp"

namespace tricoil::hal {

/// Slots. A slot is erased as a whole; after that each double-word is programmed once. If power fails during one of these
/// operations, the double-word or the slot under change may read as any value or be unreadable; all others keep their content.
class Storage : public Interface {
public:
    /// Size of one programming operation; offsets are multiples of it.
    static constexpr std::size_t kWordBytes = 8;

    [[nodiscard]] std::size_t slots() const { return do_slots(); }
    [[nodiscard]] std::size_t slot_bytes() const { return do_slot_bytes(); }

    /// Erases one slot. Thread context, coils off: the processor may stall for tens of milliseconds. ok; invalid_argument: no
    /// such slot; timed_out or device_lost: the operation failed and the content of the slot is undefined.
    Status erase(std::size_t slot) { return do_erase(slot); }

    /// Programs one double-word, its first byte at the lowest address. Thread context, coils off. ok; invalid_argument: no such
    /// slot or offset; timed_out or device_lost: the operation failed (not erased before, protected, worn out).
    Status program(std::size_t slot, std::size_t offset, std::uint64_t word) { return do_program(slot, offset, word); }

    /// Reads `to.size()` bytes, a whole number of double-words, from a multiple of kWordBytes. ok; invalid_argument: no such slot
    /// or offset; degenerate: a double-word in the range is damaged and cannot be read; the content of `to` is undefined.
    Status read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) { return do_read(slot, offset, to); }

private:
    [[nodiscard]] virtual std::size_t do_slots() const = 0;
    [[nodiscard]] virtual std::size_t do_slot_bytes() const = 0;
    virtual Status do_erase(std::size_t slot) = 0;
    virtual Status do_program(std::size_t slot, std::size_t offset, std::uint64_t word) = 0;
    virtual Status do_read(std::size_t slot, std::size_t offset, std::span<std::uint8_t> to) = 0;
};

}  // namespace tricoil::hal
