// Exclusive GPIO outputs, and edges of a GPIO input.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "drivers/gpiod/gpio_line.hpp"
#include "drivers/posix/text.hpp"

namespace tricoil::drivers {

struct GpioLineName {
    std::string chip;  // gpiochip0, its label, or a path
    std::string line;  // the line's name, or its offset
    bool active_low = false;
};

/// Outputs requested exclusively.
class GpioOutputs {
public:
    /// Requests all lines, off. device_lost, with the reason in `reason` and no line requested: a chip or line is missing,
    /// another program uses it, or there is no permission.
    Status request(const std::vector<GpioLineName>& lines, Text& reason);

    /// Sets one line. device_lost: the chip is gone.
    Status set(std::size_t line, bool on);

    /// Releases the lines at their present level; switch them off first.
    void release() { lines_.clear(); }
    [[nodiscard]] std::size_t size() const { return lines_.size(); }

private:
    std::vector<std::unique_ptr<GpioLine>> lines_;
};

/// Rising edges of one line, with the kernel's timestamps.
class GpioEdges {
public:
    Status request(const GpioLineName& line, Text& reason);  // as GpioOutputs::request
    /// Returns the oldest edge. ok; not_ready; device_lost.
    Status next(HostTime& edge);
    Status wait(Microseconds timeout);  // ok; timed_out; device_lost

private:
    std::unique_ptr<GpioLine> line_;
};

}  // namespace tricoil::drivers
