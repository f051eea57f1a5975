// Hemisphere of the sensor. A setting gives it at the start; later poses take it from the last good pose. After a loss of the
// sensor it is known as long as a hand cannot have reached the mirror image.
#pragma once

#include "core/base/time.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::tracking {

/// Highest assumed speed of a sensor during a loss, m/s: a fast hand (recorded hands reach 2).
constexpr double kMaxUnseenSpeed_m_s = 3;

/// Comparisons of positions (m, source frame) for Hemisphere, in floating point.
template <typename Scalar>
struct Sides {
    /// True if a and b lie in opposite half spaces.
    static bool are_opposite(const Vec3<Scalar>& a, const Vec3<Scalar>& b) { return a.dot(b) < 0; }

    /// True if the sensor can have moved from `last` to `near` in the time `unseen`, but not to the mirror image of `near`.
    /// Within 60 degrees `near` counts as reached: sensors may be faster than a hand. If neither can be reached, the pose is an
    /// error of the solver.
    static bool is_mirror_excluded(const Vec3<Scalar>& near, const Vec3<Scalar>& last, Microseconds unseen) {
        constexpr Scalar kMinCosine = Scalar(0.5);
        const Scalar dot = near.dot(last);
        const Scalar reach_m = Scalar(kMaxUnseenSpeed_m_s) * seconds_as<Scalar>(unseen);
        const bool is_beside = dot > 0 && dot * dot > kMinCosine * kMinCosine * near.squaredNorm() * last.squaredNorm();
        return (is_beside || (near - last).squaredNorm() <= reach_m * reach_m) && (near + last).squaredNorm() > reach_m * reach_m;
    }
};

/// X is equal at p and -p, so a pose from one signal matrix may be the mirror image behind the source. At the start of
/// tracking the setting decides, then continuity with the last good pose does: a bad pose changes nothing, so each later pose is
/// compared with the same one. A good pose whose side is unknown remains so until the setting changes. The setting ends with the
/// first good pose, because the sensor may since have moved to the other side. It stays in force only if the sensor is confined
/// to that half space (wall, table).
template <typename Scalar, typename SidesOf = Sides<Scalar>>
class Hemisphere {
public:
    /// towards: direction to the half space at the start; zero: unknown.
    Hemisphere(const Vec3<Scalar>& towards, bool confined) : towards_(towards), confined_(confined) {}

    /// False if the side of the present pose is a guess.
    [[nodiscard]] bool known() const { return known_; }

    /// Sets the direction to the present half space; zero: unknown.
    void set(const Vec3<Scalar>& towards) {
        towards_ = towards;
        fresh_ = true;
        known_ = is_set(towards);
        followed_ = false;
    }

    /// Stores a good pose from which to continue: of a sensor, converged and accurate.
    void follow(const Vec3<Scalar>& position_m, DeviceTime time) {
        last_m_ = position_m;
        last_time_ = time;
        followed_ = true;
        last_known_ = known_;
        fresh_ = false;
    }

    /// A pose that is too inaccurate to be followed. If its side is known, it stays known while the direction is within 60
    /// degrees of the last followed pose, and the range at least half of that pose's.
    void see(const Vec3<Scalar>& position_m, DeviceTime time) {
        const bool is_near = followed_ && 4 * position_m.squaredNorm() > last_m_.squaredNorm();
        if (known_ && is_near && SidesOf::is_mirror_excluded(position_m, last_m_, Microseconds{0})) {
            last_time_ = time;
        }
    }

    /// The device clock restarted: the age of the last pose is unknown.
    void forget() { followed_ = false; }

    /// The general model determined the hemisphere from the couplings.
    void resolved_by_data() { known_ = true; }

    /// True if the pose at `position_m` must be replaced by its mirror image. Decides whether the side is known.
    [[nodiscard]] bool must_mirror(const Vec3<Scalar>& position_m, DeviceTime time) {
        if (is_given() || !followed_) {
            known_ = is_given();
            return SidesOf::are_opposite(position_m, towards_);
        }
        const bool turn = SidesOf::are_opposite(position_m, last_m_);
        continue_to(turn ? Vec3<Scalar>(-position_m) : position_m, time);
        return turn;
    }

    /// A pose that a step from the last valid pose gave: it cannot be replaced by its mirror image.
    void step_to(const Vec3<Scalar>& position_m, DeviceTime time) {
        if (is_given() || !followed_) {
            known_ = is_given();
        } else {
            continue_to(position_m, time);
        }
    }

private:
    void continue_to(const Vec3<Scalar>& near_m, DeviceTime time) {
        known_ = last_known_ && SidesOf::is_mirror_excluded(near_m, last_m_, time - last_time_);
    }
    [[nodiscard]] bool is_given() const { return (fresh_ || confined_) && is_set(towards_); }
    static bool is_set(const Vec3<Scalar>& towards) { return !(towards == Vec3<Scalar>::Zero()); }

    Vec3<Scalar> towards_;
    bool confined_;
    bool fresh_ = true;  // no pose has been followed since towards_ was set
    bool known_ = false;
    bool followed_ = false;
    bool last_known_ = false;
    Vec3<Scalar> last_m_ = Vec3<Scalar>::Zero();
    DeviceTime last_time_{};
};

}  // namespace tricoil::tracking
