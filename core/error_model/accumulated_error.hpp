// Accumulated errors of the measured angles: the integrals (22), (23), (26) of the increment errors.
#pragma once

#include "core/error_model/increment_error.hpp"
#include "core/geometry/angles.hpp"

namespace tricoil::error_model {

/// Pose about which a step is linearised.
enum class Loop : std::uint8_t {
    open,    // the real previous pose, as in the paper's simulations: increment errors add up
    closed,  // the previous estimate, as in a device: the next increment corrects the old error
};

/// Errors are true minus measured. Angles are not wrapped: whole turns stay visible.
template <typename Scalar>
struct LineOfSightError {
    Scalar range_m = 0;
    Scalar azimuth_rad = 0;
    Scalar elevation_rad = 0;
};

/// Predicts the errors of the angle form from the true positions, one update after the other. It assumes a known attitude. In
/// open loop this is correct: the real attitude enters R. In closed loop the device uses its estimated attitude, which the roll
/// of (16) tilts while azimuth and elevation change together. This tilt affects the position: in example III the predicted
/// elevation is wrong by 4.5e-4 rad before the first pole and by up to half a turn after it. exact_step_error() includes the
/// attitude and predicts the closed loop correctly.
template <typename Scalar>
class AccumulatedError {
public:
    /// start: first true position; the estimate is assumed correct there.
    /// azimuth_form: the paper plots range and elevation by (29), but azimuth by (35), which assumes kappa = 2.
    AccumulatedError(KappaForm form, KappaForm azimuth_form, Loop loop, const geometry::Spherical<Scalar>& start)
        : form_(form), azimuth_form_(azimuth_form), loop_(loop), previous_(start) {}

    AccumulatedError(KappaForm form, Loop loop, const geometry::Spherical<Scalar>& start)
        : AccumulatedError(form, form, loop, start) {}

    /// Errors after the update at the true position `now` (azimuth and elevation continuous, not wrapped).
    const LineOfSightError<Scalar>& update(const geometry::Spherical<Scalar>& now) {
        const Scalar measured_elevation = previous_.elevation_rad - error_.elevation_rad;
        const bool closed = loop_ == Loop::closed;
        const Scalar start_elevation = closed ? measured_elevation : previous_.elevation_rad;
        const Scalar start_azimuth = closed ? previous_.azimuth_rad - error_.azimuth_rad : previous_.azimuth_rad;
        step_ = {start_elevation, now.azimuth_rad - start_azimuth, now.elevation_rad - start_elevation};
        // Open loop: the sum of (23), (26). Closed loop: the step contains the old error, so the new one replaces it.
        const Scalar azimuth = step_.d_azimuth_rad - measured_azimuth_increment(azimuth_form_, step_, measured_elevation);
        const Scalar elevation = elevation_increment_error(form_, step_);
        error_.azimuth_rad = closed ? azimuth : error_.azimuth_rad + azimuth;
        error_.elevation_rad = closed ? elevation : error_.elevation_rad + elevation;
        error_.range_m = range_error(now.range_m, kappa(form_, step_));
        previous_ = now;
        return error_;
    }

    [[nodiscard]] const LineOfSightError<Scalar>& error() const { return error_; }
    [[nodiscard]] const LineOfSightStep<Scalar>& step() const { return step_; }

    /// beta - e_beta: the device's elevation estimate; (17) divides by its cosine.
    [[nodiscard]] Scalar measured_elevation_rad() const { return previous_.elevation_rad - error_.elevation_rad; }

private:
    KappaForm form_;
    KappaForm azimuth_form_;
    Loop loop_;
    geometry::Spherical<Scalar> previous_;
    LineOfSightStep<Scalar> step_{};
    LineOfSightError<Scalar> error_;
};

}  // namespace tricoil::error_model
