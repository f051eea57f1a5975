#include "drivers/gpiod/gpio_coil_driver.hpp"

namespace tricoil::drivers {
namespace {

bool carries_current(Excitation state, std::size_t coil) {
    return state == Excitation::all || coil_index(state) == static_cast<int>(coil);
}

}  // namespace

Status GpioCoilDriver::open(const std::array<GpioLineName, kSourceCoils>& lines, Text& reason) {
    close();
    return lines_.request({lines.begin(), lines.end()}, reason);
}

void GpioCoilDriver::close() {
    do_switch_off();
    lines_.release();
}

Status GpioCoilDriver::do_excite(Excitation state) {
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

void GpioCoilDriver::do_switch_off() {
    for (std::size_t coil = 0; coil < lines_.size(); ++coil) {
        (void)lines_.set(coil, false);  // if a line is gone, the hardware enable switches its coil off
    }
    on_ = {};
}

}  // namespace tricoil::drivers
