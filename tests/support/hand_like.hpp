// Seeded hand motion and other motions for tests without recorded data. The simulated hand of sim/ reaches about 2 m/s.
#pragma once

#include "sim/motion/simple_motions.hpp"

namespace tricoil::test {

/// Another motion at a multiple of its speed. The other motion must outlive it.
class ScaledTime final : public sim::Motion {
public:
    ScaledTime(const sim::Motion& motion, double speed) : motion_(motion), speed_(speed) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override { return motion_.at(speed_ * t); }
    const sim::Motion& motion_;
    double speed_;
};

/// The simulated hand of sim/ at 0.7 of its speed, which equals the speed of the recorded hands.
class HandLike final : public sim::Motion {
public:
    explicit HandLike(std::uint64_t seed) : hand_({0.75, 0, 0}, seed) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override { return hand_.at(0.7 * t); }
    sim::HandMotion hand_;
};

inline HandLike hand_like(std::uint64_t seed) { return HandLike(seed); }

/// Uniform motion on a straight line with constant angular rate.
class RampMotion final : public sim::Motion {
public:
    RampMotion(const sim::Pose& start, const Vec3<double>& velocity_m_s, const Vec3<double>& rate_rad_s)
        : start_(start), velocity_m_s_(velocity_m_s), rate_rad_s_(rate_rad_s) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override {
        return {start_.position_m + t * velocity_m_s_,
                geometry::rotation_vector_to_quaternion<double>(t * rate_rad_s_) * start_.q_source_sensor};
    }
    sim::Pose start_;
    Vec3<double> velocity_m_s_;
    Vec3<double> rate_rad_s_;
};

/// At rest at one place, then at another (jump).
class StepMotion final : public sim::Motion {
public:
    StepMotion(const sim::Pose& before, const sim::Pose& after, double at_s) : before_(before), after_(after), at_s_(at_s) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override { return t < at_s_ ? before_ : after_; }
    sim::Pose before_;
    sim::Pose after_;
    double at_s_;
};

/// Moves around the source on a circle orthogonal to `axis`, and tumbles. A vertical circle (horizontal axis) passes through both
/// poles.
class OrbitMotion final : public sim::Motion {
public:
    OrbitMotion(double radius_m, const Vec3<double>& axis, double turns_per_s)
        : radius_m_(radius_m), axis_(axis.normalized()), rate_rad_s_(2 * 3.14159265358979323846 * turns_per_s) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override {
        const Vec3<double> start = radius_m_ * geometry::transverse_axes<double>(axis_).col(0);
        const Quat<double> turn = geometry::rotation_vector_to_quaternion<double>(rate_rad_s_ * t * axis_);
        const Quat<double> tumble = geometry::rotation_vector_to_quaternion<double>({0, 3 * t, 0}) *
                                    geometry::rotation_vector_to_quaternion<double>({2 * t, 0, 0});
        return {turn * start, tumble};
    }
    double radius_m_;
    Vec3<double> axis_;
    double rate_rad_s_;
};

}  // namespace tricoil::test
