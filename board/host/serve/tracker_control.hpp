// What clients ask of the tracker, carried out by the tracker's own thread between two blocks.
#pragma once

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
        if (wishes_.size() < kMost) {
            wishes_.push_back({sensor, towards});
        }
    }

    /// Stopped: coils off, no poses.
    void set_running(bool running) { running_ = running; }
    [[nodiscard]] bool running() const { return running_; }

    /// Those that have come since the last call.
    std::vector<Hemisphere> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(wishes_, {});
    }

private:
    static constexpr std::size_t kMost = 64;  // a client that floods asks in vain
    std::atomic<bool> running_ = true;
    std::mutex mutex_;
    std::vector<Hemisphere> wishes_;
};

}  // namespace tricoil::host
