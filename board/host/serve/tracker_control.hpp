// Requests of clients to the tracker, executed by the tracker's thread between two blocks.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "core/geometry/types.hpp"

namespace tricoil::host {

class TrackerControl {
public:
    struct Hemisphere {
        std::uint8_t sensor = 0;
        Vec3<double> towards = Vec3<double>::Zero();
    };

    void set_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
        const std::lock_guard lock(mutex_);
        const auto same = std::find_if(wishes_.begin(), wishes_.end(), [&](const auto& wish) { return wish.sensor == sensor; });
        if (same != wishes_.end()) {  // only the newest request per sensor is kept, so that a flood does not delay other clients
            same->towards = towards;
        } else {
            wishes_.push_back({sensor, towards});
        }
    }

    /// Paused: coils off, no poses.
    void set_running(bool running) { running_ = running; }
    [[nodiscard]] bool running() const { return running_; }

    /// Requests since the last call.
    std::vector<Hemisphere> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(wishes_, {});
    }

private:
    std::atomic<bool> running_ = true;
    std::mutex mutex_;
    std::vector<Hemisphere> wishes_;  // at most one per sensor
};

}  // namespace tricoil::host
