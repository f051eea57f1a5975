// State of a tracker, common to all methods.
#pragma once

#include <utility>

#include "core/base/time.hpp"
#include "core/tracking/pose_flags.hpp"

namespace tricoil::tracking {

/// searching -> tracking on a valid pose; tracking -> lost after lost_after without one; lost -> searching after search_after.
class TrackState {
public:
    [[nodiscard]] TrackerState state() const { return state_; }

    /// A valid pose, measured at `time`. True if it ends a search. params: lost_after and search_after.
    template <typename Params>
    bool found(DeviceTime time, const Params& params) {
        missed(time, params);
        last_valid_ = time;
        return std::exchange(state_, TrackerState::tracking) != TrackerState::tracking;
    }

    /// No valid pose since the last call of found() until `now`.
    template <typename Params>
    void missed(DeviceTime now, const Params& params) {
        if (state_ == TrackerState::tracking && is_older(params.lost_after, now)) {
            state_ = TrackerState::lost;
        }
        if (state_ == TrackerState::lost && is_older(params.search_after, now)) {
            state_ = TrackerState::searching;
        }
    }

    /// True if the last valid pose is older than `age`.
    [[nodiscard]] bool is_older(Microseconds age, DeviceTime now) const { return now - last_valid_ > age; }

    /// The device clock restarted at `now`.
    void restart(DeviceTime now) {
        state_ = TrackerState::searching;
        last_valid_ = now;
    }

private:
    TrackerState state_ = TrackerState::searching;
    DeviceTime last_valid_{};
};

}  // namespace tricoil::tracking
