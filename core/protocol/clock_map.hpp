// Conversion of device time to host time, from pairs of send time (device) and receive time (host). The delay of messages varies
// but is never negative. The messages with the least delay in each interval therefore lie on the line that relates the two
// clocks. Its slope is the drift. No message lies below it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/base/assertion.hpp"
#include "core/base/time.hpp"

namespace tricoil::protocol {

class ClockMap {
public:
    static constexpr std::int64_t kStretchUs = 500'000;
    static constexpr std::size_t kStretches = 16;
    static constexpr std::int64_t kLongestDelayUs = 1'000'000;

    /// Records that a message of time `device` arrived at `host`. The map restarts if the device time goes back by more than
    /// kStretchUs or jumps ahead by more than kMemoryUs, or if a message is early or late by more than kLongestDelayUs.
    void observe(DeviceTime device, HostTime host) {
        const std::int64_t device_us = to_us(device);
        const std::int64_t host_us = to_us(host);
        if (ready() && has_jumped(device, host)) {
            *this = {};
        }
        newest_us_ = ready() ? std::max(newest_us_, device_us) : device_us;
        const Point point{device_us, host_us - device_us};
        const bool first_stretch = count_ == 0;
        if (first_stretch || device_us - begin_us_ >= kStretchUs) {
            begin_us_ = device_us;
            newest_ = first_stretch ? 0 : (newest_ + 1) % kStretches;
            count_ = count_ < kStretches ? count_ + 1 : kStretches;
            least_[newest_] = point;
            fit();
        } else if (point.lateness_us < least_[newest_].lateness_us) {
            least_[newest_] = point;
            if (count_ == 1) {
                fit();
            }
        }
        keep_below(point);
    }

    [[nodiscard]] bool ready() const { return count_ > 0; }

    /// Host time of a device time; it includes the shortest delay of the link. Needs ready().
    [[nodiscard]] HostTime to_host(DeviceTime device) const {
        TRICOIL_ASSERT(ready());
        const std::int64_t device_us = to_us(device);
        return host_time_us(device_us + std::llround(offset_us_ + drift_ * static_cast<double>(device_us - origin_us_)));
    }

    /// Drift of the host clock relative to the device clock, as a fraction.
    [[nodiscard]] double drift() const { return drift_; }

    /// Largest distance of the least-delay messages from the line: the error of the map without the link's shortest delay. Needs
    /// ready().
    [[nodiscard]] double error_bound_us() const { return bound_us_; }

private:
    static constexpr std::int64_t kMemoryUs = kStretchUs * static_cast<std::int64_t>(kStretches);
    static constexpr std::size_t kMinForDrift = 4;

    struct Point {
        std::int64_t device_us = 0;
        std::int64_t lateness_us = 0;
    };

    [[nodiscard]] bool has_jumped(DeviceTime device, HostTime host) const {
        const std::int64_t ahead_us = to_us(device) - newest_us_;
        return ahead_us < -kStretchUs || ahead_us > kMemoryUs || std::abs((host - to_host(device)).count()) > kLongestDelayUs;
    }

    /// Fits a line to the least-delay point of each complete interval. The current interval is used only if it is the first.
    void fit() {
        const std::size_t origin = count_ == 1 ? newest_ : (newest_ + kStretches - 1) % kStretches;
        origin_us_ = least_[origin].device_us;
        const std::int64_t base = least_[origin].lateness_us;
        const auto counts = [&](std::size_t i) { return count_ == 1 || i != newest_; };
        double n = 0;
        double x = 0;
        double y = 0;
        double xx = 0;
        double xy = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!counts(i)) {
                continue;
            }
            const auto dx = static_cast<double>(least_[i].device_us - origin_us_);
            const auto dy = static_cast<double>(least_[i].lateness_us - base);
            n += 1;
            x += dx;
            y += dy;
            xx += dx * dx;
            xy += dx * dy;
        }
        const double spread = n * xx - x * x;
        drift_ = count_ >= kMinForDrift && spread > 0 ? (n * xy - x * y) / spread : 0;
        const double intercept = (y - drift_ * x) / n;
        offset_us_ = static_cast<double>(base) + intercept;
        for (std::size_t i = 0; i < count_; ++i) {
            keep_below(least_[i]);
        }
        bound_us_ = 1;  // both clocks tick in whole microseconds
        for (std::size_t i = 0; i < count_; ++i) {
            if (counts(i)) {
                bound_us_ = std::fmax(bound_us_, 1 + above_line(least_[i]));
            }
        }
    }

    /// Lateness of a message above the line, us.
    [[nodiscard]] double above_line(const Point& point) const {
        return static_cast<double>(point.lateness_us) - offset_us_ - drift_ * static_cast<double>(point.device_us - origin_us_);
    }

    /// Moves the line so that it does not lie above a message: no message arrives before it was sent.
    void keep_below(const Point& point) {
        const double early_us = std::fmax(0, -above_line(point));
        offset_us_ -= early_us;
        bound_us_ += early_us;
    }

    std::array<Point, kStretches> least_{};
    std::size_t count_ = 0;
    std::size_t newest_ = 0;
    std::int64_t begin_us_ = 0;
    std::int64_t newest_us_ = 0;
    std::int64_t origin_us_ = 0;
    double offset_us_ = 0;
    double drift_ = 0;
    double bound_us_ = 0;
};

}  // namespace tricoil::protocol
