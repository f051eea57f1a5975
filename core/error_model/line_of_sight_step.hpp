// One update of the line of sight in the paper's angles: start of the step and angle increments.
#pragma once

#include <cmath>

namespace tricoil::error_model {

/// The step goes from the pose about which the measurement is linearised to the real pose. Open loop: from the real previous
/// pose. Closed loop: from the previous estimate. Azimuth and range are not needed: the errors do not depend on them (remark 3).
template <typename Scalar>
struct LineOfSightStep {
    Scalar elevation_rad;    // beta_1, at the start of the step
    Scalar d_azimuth_rad;    // Delta alpha_1 of (30)
    Scalar d_elevation_rad;  // Delta beta_1 of (30)

    [[nodiscard]] Scalar end_elevation_rad() const { return elevation_rad + d_elevation_rad; }
};

/// Cosine of the angle between the real line of sight and that at the start of the step.
template <typename Scalar>
Scalar cosine_of_turn(const LineOfSightStep<Scalar>& step) {
    return std::cos(step.end_elevation_rad()) * std::cos(step.elevation_rad) * std::cos(step.d_azimuth_rad) +
           std::sin(step.end_elevation_rad()) * std::sin(step.elevation_rad);
}

}  // namespace tricoil::error_model
