// Which side of the source the sensor is on: told, then followed, and after a loss only as far as that goes.
#pragma once

#include "core/base/time.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::tracking {

/// Fastest that a sensor moves while it is not seen, m/s: a fast hand (recorded ones reach 2).
constexpr double kFastestUnseen_m_s = 3;

/// What Hemisphere asks about positions (3, metres, source frame), in floating point.
template <typename Scalar>
struct Sides {
    /// Whether a and b lie in opposite half spaces.
    static bool are_opposite(const Vec3<Scalar>& a, const Vec3<Scalar>& b) { return a.dot(b) < 0; }

    /// Whether the mirror image of `near` is out of question: further from `last` than the sensor can have come in the time
    /// `unseen`, and not within 120 degrees of it. The latter is for what is no motion at all: a throw, or a solver's slip.
    static bool is_mirror_excluded(const Vec3<Scalar>& near, const Vec3<Scalar>& last, Microseconds unseen) {
        constexpr Scalar kLeastCosine = Scalar(0.5);
        const Scalar dot = near.dot(last);
        const Scalar reach_m = Scalar(kFastestUnseen_m_s) * seconds_as<Scalar>(unseen);
        return dot * dot > kLeastCosine * kLeastCosine * near.squaredNorm() * last.squaredNorm() &&
               (near + last).squaredNorm() > reach_m * reach_m;
    }
};

/// X is even in the position, so a pose from one signal matrix may as well be its mirror image behind the source. The setting
/// says which it is where tracking starts; from there continuity does. A setting is used up by the first pose that is followed:
/// where the sensor has gone since, it cannot know. Unless the sensor is confined to that half space, by a wall or a table.
template <typename Scalar, typename SidesOf = Sides<Scalar>>
class Hemisphere {
public:
    /// towards: into the half space the sensor starts in; zero: unknown.
    Hemisphere(const Vec3<Scalar>& towards, bool confined) : towards_(towards), confined_(confined) {}

    /// Whether the last resolve() was more than a guess.
    [[nodiscard]] bool known() const { return known_; }

    /// Where the sensor is now; zero makes it unknown.
    void set(const Vec3<Scalar>& towards) {
        towards_ = towards;
        fresh_ = true;
        known_ = is_told(towards);
        if (followed_ && SidesOf::are_opposite(last_m_, towards)) {
            last_m_ = -last_m_;
        }
    }

    /// A pose that is sure, to be continued from.
    void follow(const Vec3<Scalar>& position_m, DeviceTime time) {
        last_m_ = position_m;
        last_time_ = time;
        followed_ = true;
        fresh_ = false;
    }

    /// The clock started anew: nobody knows how long ago the last pose was.
    void forget() { followed_ = false; }

    /// The model itself told the side.
    void resolved_by_data() { known_ = true; }

    /// Whether the pose at `position_m` must be turned to the other side of the source.
    [[nodiscard]] bool must_turn(const Vec3<Scalar>& position_m, DeviceTime time) {
        const bool told = (fresh_ || confined_) && is_told(towards_);
        if (told || !followed_) {
            known_ = told;
            return SidesOf::are_opposite(position_m, towards_);
        }
        const bool turn = SidesOf::are_opposite(position_m, last_m_);
        const Vec3<Scalar> near = turn ? Vec3<Scalar>(-position_m) : position_m;
        known_ = known_ && SidesOf::is_mirror_excluded(near, last_m_, time - last_time_);
        return turn;
    }

private:
    static bool is_told(const Vec3<Scalar>& towards) { return !(towards == Vec3<Scalar>::Zero()); }

    Vec3<Scalar> towards_;
    bool confined_;
    bool fresh_ = true;  // the setting has not been followed by a pose yet
    bool known_ = false;
    bool followed_ = false;
    Vec3<Scalar> last_m_ = Vec3<Scalar>::Zero();
    DeviceTime last_time_{};
};

}  // namespace tricoil::tracking
