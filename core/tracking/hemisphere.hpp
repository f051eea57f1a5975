// Which side of the source the sensor is on: told, then followed, and after a loss only as far as that goes.
#pragma once

#include "core/base/time.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::tracking {

/// Fastest that a sensor moves while it is not seen, m/s: a fast hand (recorded ones reach 2).
constexpr double kFastestUnseen_m_s = 3;

/// X is even in the position, so a pose from one signal matrix may as well be its mirror image behind the source. The setting
/// says which it is where tracking starts; from there continuity does. A setting is used up by the first pose that is followed:
/// where the sensor has gone since, it cannot know. Unless the sensor is confined to that half space, by a wall or a table.
template <typename Scalar>
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
        known_ = !towards.isZero();
        if (followed_ && last_m_.dot(towards) < 0) {
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
        const bool told = (fresh_ || confined_) && !towards_.isZero();
        if (told || !followed_) {
            known_ = told;
            return position_m.dot(towards_) < 0;
        }
        const bool turn = position_m.dot(last_m_) < 0;
        known_ = known_ && is_certain(turn ? Vec3<Scalar>(-position_m) : position_m, time);
        return turn;
    }

private:
    /// Whether the mirror image of `near` is out of question: further from the last pose than the sensor can have come since, and
    /// not within 120 degrees of it. The latter is for what is no motion at all: a throw, or a solver's slip.
    [[nodiscard]] bool is_certain(const Vec3<Scalar>& near, DeviceTime time) const {
        constexpr Scalar kLeastCosine = Scalar(0.5);
        const Scalar dot = near.dot(last_m_);
        const Scalar reach_m = Scalar(kFastestUnseen_m_s) * seconds_as<Scalar>(time - last_time_);
        return dot * dot > kLeastCosine * kLeastCosine * near.squaredNorm() * last_m_.squaredNorm() &&
               (near + last_m_).squaredNorm() > reach_m * reach_m;
    }

    Vec3<Scalar> towards_;
    bool confined_;
    bool fresh_ = true;  // the setting has not been followed by a pose yet
    bool known_ = false;
    bool followed_ = false;
    Vec3<Scalar> last_m_ = Vec3<Scalar>::Zero();
    DeviceTime last_time_{};
};

}  // namespace tricoil::tracking
