#include "board/sim_front_end/gpio_watch.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>

#include "board/support/errors.hpp"

namespace tricoil::sim_front_end {

GpioWatch::GpioWatch(const std::string& folder, Microseconds hold, bool has_heartbeat)
    : hold_(hold), has_heartbeat_(has_heartbeat) {
    for (std::size_t line = 0; line < values_.size(); ++line) {
        const std::string path = folder + "/sim_gpio" + std::to_string(line) + "/value";
        values_[line].reset(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        if (!values_[line].is_open()) {
            throw host::DeviceError(path + ": no simulated GPIO line; --gpio needs the folder of the chip in sysfs");
        }
    }
    sync_.reset(::open((folder + "/sim_gpio4/pull").c_str(), O_WRONLY | O_CLOEXEC));
}

void GpioWatch::drive_sync(bool high) {
    const std::string_view pull = high ? "pull-up" : "pull-down";
    if (::pwrite(sync_.get(), pull.data(), pull.size(), 0) != std::ssize(pull)) {
        throw host::DeviceError("the simulated sync line cannot be driven");
    }
}

bool GpioWatch::level(std::size_t line) const {
    char value = '0';
    return ::pread(values_[line].get(), &value, 1, 0) == 1 && value == '1';
}

Excitation GpioWatch::read_lines(HostTime now) {
    const bool beat = level(3);
    if (beat != beat_level_) {
        beat_level_ = beat;
        beat_ = now;
        enabled_ = true;
    } else if (enabled_ && now - beat_ > hold_) {
        enabled_ = false;
        report_.longest_enable_us = std::max(report_.longest_enable_us, (now - beat_).count());
    }
    std::array<bool, kSourceCoils> on{level(0), level(1), level(2)};
    if (std::count(on.begin(), on.end(), true) > 1) {
        // A line may have gone low after it was read. Reads again: lines that are still high were on at the same time.
        for (std::size_t coil = 0; coil < on.size(); ++coil) {
            on[coil] = on[coil] && level(coil);
        }
    }
    count_changes(on);
    report_.on_at_end = on[0] || on[1] || on[2];
    report_.enabled_at_end = enabled_;
    if (has_heartbeat_ && !enabled_) {
        return Excitation::off;
    }
    const auto count = std::count(on.begin(), on.end(), true);
    if (count == kSourceCoils) {
        return Excitation::all;
    }
    const auto first = std::find(on.begin(), on.end(), true) - on.begin();
    return count == 1 ? single_coil(static_cast<int>(first)) : Excitation::off;
}

void GpioWatch::count_changes(const std::array<bool, kSourceCoils>& on) {
    report_.several_on += std::count(on.begin(), on.end(), true) > 1 ? 1U : 0U;
    for (int coil = 0; coil < kSourceCoils; ++coil) {
        const auto k = static_cast<std::size_t>(coil);
        if (on[k] && !on_[k]) {
            const bool in_turn = last_coil_ < 0 || coil == (last_coil_ + 1) % kSourceCoils;
            report_.out_of_turn += in_turn ? 0U : 1U;
            ++report_.turned_on;
            last_coil_ = coil;
        }
    }
    on_ = on;
}

}  // namespace tricoil::sim_front_end
