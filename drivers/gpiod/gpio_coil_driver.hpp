// Coil driver on three GPIO lines, break before make.
#pragma once

#include <array>

#include "drivers/gpiod/gpio_lines.hpp"
#include "hal/coil_driver.hpp"

namespace tricoil::drivers {

class GpioCoilDriver final : public hal::CoilDriver {
public:
    GpioCoilDriver() = default;
    ~GpioCoilDriver() override { close(); }

    /// Requests the lines of S1, S2 and S3, off. device_lost: see GpioOutputs::request.
    Status open(const std::array<GpioLineName, kSourceCoils>& lines, Text& reason);

    /// Switches the lines off and releases them.
    void close();

private:
    Status do_excite(Excitation state) override;
    void do_switch_off() override;

    GpioOutputs lines_;
    std::array<bool, kSourceCoils> on_{};
};

}  // namespace tricoil::drivers
