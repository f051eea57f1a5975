// One update of the line of sight, in the paper's angles: where the step starts and by how much the sensor turns in it.
#pragma once

#include <cmath>

namespace tricoil::error_model {

/// The step runs from the pose that the measurement is linearised about (open loop: the real previous pose; closed loop: the
/// previous estimate) to the real pose. Neither azimuth itself nor range enters: the errors do not depend on them (remark 3).
template <typename Scalar>
struct LineOfSightStep {
    Scalar elevation_rad;    // beta_1, where the step starts
    Scalar d_azimuth_rad;    // Delta alpha_1 of (30)
    Scalar d_elevation_rad;  // Delta beta_1 of (30)

    [[nodiscard]] Scalar end_elevation_rad() const { return elevation_rad + d_elevation_rad; }
};

/// cos of the angle between the real line of sight and the one that the step starts from.
template <typename Scalar>
Scalar cosine_of_turn(const LineOfSightStep<Scalar>& step) {
    return std::cos(step.end_elevation_rad()) * std::cos(step.elevation_rad) * std::cos(step.d_azimuth_rad) +
           std::sin(step.end_elevation_rad()) * std::sin(step.elevation_rad);
}

}  // namespace tricoil::error_model
