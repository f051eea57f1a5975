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
    Status open(const std::array<GpioLineName, kSourceCoils>& lines, Text& reason) {
        close();
        return lines_.request({lines.begin(), lines.end()}, reason);
    }

    /// Switches the lines off and releases them.
    void close() {
        do_switch_off();
        lines_.release();
    }

private:
    static bool carries_current(Excitation state, std::size_t coil) {
        return state == Excitation::all || coil_index(state) == static_cast<int>(coil);
    }

    Status do_excite(Excitation state) override {
        // Break before make: first the lines that go off, then those that go on.
        for (const bool target : {false, true}) {
            for (std::size_t coil = 0; coil < on_.size(); ++coil) {
                if (carries_current(state, coil) != target || on_[coil] == target) {
                    continue;
                }
                if (const Status status = lines_.set(coil, target); !status.ok()) {
                    return status;
                }
                on_[coil] = target;
            }
        }
        return {};
    }
    void do_switch_off() override {
        for (std::size_t coil = 0; coil < lines_.size(); ++coil) {
            (void)lines_.set(coil, false);  // if a line is gone, the hardware enable switches its coil off
        }
        on_ = {};
    }

    GpioOutputs lines_;
    std::array<bool, kSourceCoils> on_{};
};

}  // namespace tricoil::drivers
