// Restores the hemisphere of a tracker from the last valid pose.
#pragma once

#include <optional>

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/state/hemisphere.hpp"

namespace tricoil::linux_board {

/// After a jump of the device's clock or a damaged column the tracker assumes a long dropout, in which the sensor may have moved
/// anywhere. A restarted tracker has no earlier pose. The host's clock shows the real, short time. If the sensor cannot have
/// reached the mirror image since the last valid pose, the hemisphere is known. After a real long dropout the user must set it.
class HemisphereRestorer {
public:
    /// Call it with each pose of one sensor and the host's time. Returns the hemisphere for the tracker if only the hemisphere is
    /// missing and it is known.
    std::optional<Vec3<double>> side(const tracking::PoseEstimate<double>& estimate, HostTime now) {
        if (estimate.valid()) {
            last_m_ = estimate.position_m;
            last_ = now;
            return std::nullopt;
        }
        if (!last_m_ || !lacks_only_hemisphere(estimate)) {
            return std::nullopt;
        }
        using Sides = tracking::Sides<double>;
        const Vec3<double>& p = estimate.position_m;
        const Vec3<double> near = Sides::are_opposite(p, *last_m_) ? Vec3<double>(-p) : p;
        const bool known = Sides::is_mirror_excluded(near, *last_m_, now - last_);
        return known ? std::optional(near) : std::nullopt;
    }

    /// True if there was a valid pose: the sensor may since have left the half space of the configuration.
    [[nodiscard]] bool has_tracked() const { return last_m_.has_value(); }

    /// True if the unknown hemisphere is the only reason why the pose is invalid.
    [[nodiscard]] static bool lacks_only_hemisphere(const tracking::PoseEstimate<double>& estimate) {
        constexpr tracking::PoseFlags kUnknown{tracking::PoseFlag::hemisphere_unknown};
        return (estimate.flags.bits() & tracking::kInvalidating.bits()) == kUnknown.bits() && estimate.position_m.allFinite();
    }

private:
    std::optional<Vec3<double>> last_m_;
    HostTime last_;
};

}  // namespace tricoil::linux_board
