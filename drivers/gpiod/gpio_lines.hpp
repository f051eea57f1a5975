// Exclusive GPIO outputs, and edges of a GPIO input.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "drivers/gpiod/gpio_line.hpp"
#include "drivers/posix/text.hpp"
#include "hal/sync_line.hpp"

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

/// Rising edges of one input, with the kernel's timestamps: the sync line from the front end.
class GpioSyncLine final : public hal::SyncLine {
public:
    Status open(const GpioLineName& line, Text& reason);  // as GpioOutputs::request

private:
    Status do_next_edge(HostTime& edge) override;
    Status do_wait(Microseconds timeout) override;

    std::unique_ptr<GpioLine> line_;
};

}  // namespace tricoil::drivers
