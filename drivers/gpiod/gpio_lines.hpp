// What tricoil needs of GPIO lines, whichever version of libgpiod provides it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "drivers/posix/text.hpp"

namespace tricoil::drivers {

struct GpioLineName {
    std::string chip;  // gpiochip0, its label, or a path
    std::string line;  // the line's name, or its offset
    bool active_low = false;
};

/// Outputs held by this program alone.
class GpioOutputs {
public:
    GpioOutputs();
    GpioOutputs(const GpioOutputs&) = delete;
    GpioOutputs& operator=(const GpioOutputs&) = delete;
    ~GpioOutputs();

    /// Takes all of the lines, off. device_lost, with the reason in `why` and none taken: a chip or line is missing, another
    /// program has it, or there is no permission.
    Status request(const std::vector<GpioLineName>& lines, Text& why);

    /// One line. device_lost: the chip is gone.
    Status set(std::size_t line, bool on);

    /// As they are; switch them off before.
    void release();
    [[nodiscard]] std::size_t size() const;

private:
    struct Lines;
    std::unique_ptr<Lines> lines_;
};

/// Rising edges of one line, with the kernel's time.
class GpioEdges {
public:
    GpioEdges();
    GpioEdges(const GpioEdges&) = delete;
    GpioEdges& operator=(const GpioEdges&) = delete;
    ~GpioEdges();

    Status request(const GpioLineName& line, Text& why);  // as GpioOutputs::request
    /// The oldest edge. ok; not_ready; device_lost.
    Status next(std::int64_t& monotonic_us);
    Status wait(Microseconds timeout);  // ok; timed_out; device_lost

private:
    struct Line;
    std::unique_ptr<Line> line_;
};

}  // namespace tricoil::drivers
