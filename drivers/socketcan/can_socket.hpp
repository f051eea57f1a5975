// A raw CAN socket: opens, sends and receives single frames with timestamps.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <span>
#include <string>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/protocol/can_mapping.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/text.hpp"

namespace tricoil::drivers {

/// One frame from the kernel.
struct CanReception {
    protocol::CanFrame frame;
    bool is_error = false;  // an error frame: `frame.id` holds its class bits
    bool is_fd = false;
    HostTime arrival{};
    std::int64_t hardware_time_us = 0;
    std::uint32_t dropped = 0;  // dropped by the kernel since the socket was opened, because its buffer was full
};

class CanSocket {
public:
    /// Binds to the interface; receives identifiers that match a filter, and error frames. Sets `why` if not ok. device_lost: no
    /// such interface, not a CAN interface, classic CAN only, or no permission. An interface that is down is not an error.
    Status open(const std::string& interface, std::span<const can_filter> filters, Text& why);
    void close() { fd_.reset(); }

    /// ok; not_ready: the queue is full, or the link is down (then `link_down` is true); device_lost: the interface is gone.
    Status send(const protocol::CanFrame& frame, bool& link_down);

    /// ok; not_ready: no frame; timed_out: the link went down; device_lost: the interface is gone.
    Status receive(CanReception& reception);

    [[nodiscard]] int fd() const { return fd_.get(); }
    [[nodiscard]] bool is_open() const { return fd_.is_open(); }

private:
    FileDescriptor fd_;
};

}  // namespace tricoil::drivers
