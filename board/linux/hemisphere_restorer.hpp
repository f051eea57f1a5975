// Restores the hemisphere of a tracker that has lost it, if the host still knows it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/tracking/hemisphere.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::linux_board {

/// After a jump of the device's clock or a damaged column the tracker assumes a long dropout, in which the sensor may have moved
/// anywhere. The host's clock shows the real, short time. If the sensor cannot have reached the mirror image since the last valid
/// pose, the hemisphere is known. After a real long dropout the user must set it.
class HemisphereRestorer {
public:
    /// Call it with each pose of one sensor and the host's time. Returns the hemisphere for the tracker if only that is missing.
    std::optional<Vec3<double>> side(const tracking::PoseEstimate<double>& estimate, HostTime now) {
        if (estimate.valid()) {
            last_m_ = estimate.position_m;
            last_ = now;
            return std::nullopt;
        }
        tracking::PoseFlags others;
        for (const auto flag : kOthers) {
            others.set_if(estimate.flags.has(flag), flag);
        }
        if (!last_m_ || !others.empty() || !estimate.position_m.allFinite()) {
            return std::nullopt;
        }
        using Sides = tracking::Sides<double>;
        const Vec3<double>& p = estimate.position_m;
        const Vec3<double> near = Sides::are_opposite(p, *last_m_) ? Vec3<double>(-p) : p;
        const bool known = Sides::is_mirror_excluded(near, *last_m_, now - last_);
        return known ? std::optional(near) : std::nullopt;
    }

private:
    // Flags that invalidate a pose, except hemisphere_unknown.
    static constexpr std::array kOthers{tracking::PoseFlag::saturated,        tracking::PoseFlag::low_signal,
                                        tracking::PoseFlag::no_sensor,        tracking::PoseFlag::stale,
                                        tracking::PoseFlag::wrong_handedness, tracking::PoseFlag::not_converged,
                                        tracking::PoseFlag::no_reference,     tracking::PoseFlag::unconfirmed,
                                        tracking::PoseFlag::inconsistent,     tracking::PoseFlag::uncertain};

    std::optional<Vec3<double>> last_m_;
    HostTime last_;
};

}  // namespace tricoil::linux_board
