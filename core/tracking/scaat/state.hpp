// State of the filter: motion and covariance.
#pragma once

#include "core/base/time.hpp"
#include "core/linear/quaternion.hpp"
#include "core/tracking/judge/body_motion.hpp"

namespace tricoil::tracking::scaat {

constexpr int kErrorStates = 12;

template <typename Scalar>
using Vec12 = Matrix<Scalar, kErrorStates, 1>;
template <typename Scalar>
using Mat12 = Matrix<Scalar, kErrorStates, kErrorStates>;

/// Pose, rates and accelerations, in the source frame.
template <typename Scalar>
struct Motion {
    DeviceTime time{};
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();
    Vec3<Scalar> velocity_m_s = Vec3<Scalar>::Zero();
    Vec3<Scalar> rate_rad_s = Vec3<Scalar>::Zero();
    Vec3<Scalar> acceleration_m_s2 = Vec3<Scalar>::Zero();
    Vec3<Scalar> angular_acceleration_rad_s2 = Vec3<Scalar>::Zero();
};

/// Covariance in the source frame. The error state is (position m, small rotation rad, velocity m/s, angular rate rad/s): pose
/// and rates are two blocks of six. Attitude error r: q_true = exp(r) q. The accelerations are not part of the error state; they
/// are learnt from velocity corrections (learn_acceleration) and used only for prediction.
template <typename Scalar>
struct State : Motion<Scalar> {
    Mat12<Scalar> covariance = Mat12<Scalar>::Zero();
};
static_assert(sizeof(State<float>) <= 704, "size of a state in float: 12x12 covariance, 19 numbers and a time");

/// True if the rates of the motion are possible for a body. A state beyond these limits is not continued.
template <typename Scalar>
bool is_possible(const Motion<Scalar>& motion) {
    constexpr Scalar kMaxSpeed = Scalar(kMaxBodySpeed_m_s);
    constexpr Scalar kMaxRate = Scalar(kMaxBodyRate_rad_s);
    return motion.velocity_m_s.squaredNorm() <= kMaxSpeed * kMaxSpeed && motion.rate_rad_s.squaredNorm() <= kMaxRate * kMaxRate;
}

/// Mirror image of the motion: position, velocity and acceleration change sign, rotation does not.
template <typename Scalar>
void mirror(State<Scalar>& state) {
    state.position_m = -state.position_m;
    state.velocity_m_s = -state.velocity_m_s;
    state.acceleration_m_s2 = -state.acceleration_m_s2;
    for (int j = 0; j < kErrorStates; ++j) {
        for (int i = 0; i < kErrorStates; ++i) {
            Scalar& entry = state.covariance(i, j);
            entry = (i / 3 + j / 3) % 2 == 0 ? entry : -entry;
        }
    }
}

}  // namespace tricoil::tracking::scaat
