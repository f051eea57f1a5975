// Requests of clients to the tracker, executed by the tracker's thread between two blocks.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

class TrackerControl {
public:
    struct Hemisphere {
        std::uint8_t sensor = 0;
        Vec3<double> towards = Vec3<double>::Zero();
    };

    /// hemisphere_refusal: text for clients that set the hemisphere by the position of a pose; empty: they can.
    explicit TrackerControl(std::string hemisphere_refusal = "") : hemisphere_refusal_(std::move(hemisphere_refusal)) {}

    [[nodiscard]] const std::string& hemisphere_refusal() const { return hemisphere_refusal_; }

    void set_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
        const std::lock_guard lock(mutex_);
        const auto same =
            std::find_if(requests_.begin(), requests_.end(), [&](const auto& request) { return request.sensor == sensor; });
        // Only the newest request per sensor is kept, so that a flood does not delay other clients.
        if (same != requests_.end()) {
            same->towards = towards;
        } else {
            requests_.push_back({sensor, towards});
        }
    }

    /// false: coils off, no poses.
    void set_running(bool running) { running_ = running; }
    [[nodiscard]] bool running() const { return running_; }

    /// Requests since the last call.
    std::vector<Hemisphere> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(requests_, {});
    }

private:
    std::string hemisphere_refusal_;
    std::atomic<bool> running_ = true;
    std::mutex mutex_;
    std::vector<Hemisphere> requests_;  // at most one per sensor
};

}  // namespace tricoil::host
