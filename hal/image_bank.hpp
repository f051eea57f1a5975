// Update of a device's own program: memory for a second image, which is tried once before it replaces the running one.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/interface.hpp"
#include "core/base/status.hpp"

namespace tricoil::hal {

/// If power fails at any time, or the new image fails, the device runs its old image. All functions: thread context, coils off.
class ImageBank : public Interface {
public:
    /// The next part, whole double-words, in order and without gaps; offset 0 begins a new image; bytes after its end are
    /// ignored. The processor may stall for tens of milliseconds. ok; invalid_argument: not an image for this device, nothing was
    /// changed; not_ready: size() is not `offset`; timed_out or device_lost: the memory failed; degenerate: the image is
    /// complete, but its CRC is wrong.
    Status write(std::uint32_t offset, std::span<const std::uint8_t> part) { return do_write(offset, part); }

    /// Bytes of the new image that are stored.
    [[nodiscard]] std::uint32_t size() const { return do_size(); }

    /// The new image is complete and its CRC is right.
    [[nodiscard]] bool is_complete() const { return do_is_complete(); }

    /// Resets. `on_trial`: into the other image, until the next reset; otherwise into the confirmed one. Does not return on a
    /// processor; a simulation counts the call.
    void restart(bool on_trial) { do_restart(on_trial); }

    /// The running image is not confirmed yet.
    [[nodiscard]] bool is_on_trial() const { return do_is_on_trial(); }

    /// From now on the running image starts after each reset. device_lost: the memory failed; the old one starts.
    Status confirm() { return do_confirm(); }

private:
    virtual Status do_write(std::uint32_t offset, std::span<const std::uint8_t> part) = 0;
    [[nodiscard]] virtual std::uint32_t do_size() const = 0;
    [[nodiscard]] virtual bool do_is_complete() const = 0;
    virtual void do_restart(bool on_trial) = 0;
    [[nodiscard]] virtual bool do_is_on_trial() const = 0;
    virtual Status do_confirm() = 0;
};

}  // namespace tricoil::hal
