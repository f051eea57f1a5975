// Motion of a sensor at one instant.
#pragma once

#include "core/linear/quaternion.hpp"

namespace tricoil::error_model {

/// All vectors are in the source frame. Rates are true or estimated.
template <typename Scalar>
struct MotionState {
    Vec3<Scalar> position_m = Vec3<Scalar>::UnitX();
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();  // v_source = q v_sensor
    Vec3<Scalar> velocity_m_s = Vec3<Scalar>::Zero();
    Vec3<Scalar> angular_rate_rad_s = Vec3<Scalar>::Zero();
    // Used only for the blur of a window. Zero if unknown.
    Vec3<Scalar> acceleration_m_s2 = Vec3<Scalar>::Zero();
    Vec3<Scalar> angular_acceleration_rad_s2 = Vec3<Scalar>::Zero();
};

}  // namespace tricoil::error_model
