// The integrals (22), (23), (26): how increment errors add up to the errors of the measured angles.
#pragma once

#include "core/error_model/increment_error.hpp"
#include "core/geometry/angles.hpp"

namespace tricoil::error_model {

/// What a step is linearised about.
enum class Loop : std::uint8_t {
    open,    // the real previous pose: the paper's simulations; every increment error stays for ever
    closed,  // the previous estimate, as in any device: the next increment takes the old error in as well
};

/// Errors are true minus measured. Angles are not wrapped: whole turns stay visible.
template <typename Scalar>
struct LineOfSightError {
    Scalar range_m = 0;
    Scalar azimuth_rad = 0;
    Scalar elevation_rad = 0;
};

/// Predicts the errors of the angle form from the true positions alone, one update after the other. Takes the attitude for known.
/// In open loop it is: the real one enters R. In closed loop the device has only its estimate, which the roll of (16) tilts while
/// azimuth and elevation turn together, and the tilt feeds back: of example III the elevation is off by 4.5e-4 rad before the
/// first pole, by up to half a turn after it. exact_step_error, which carries the attitude along, follows the loop.
template <typename Scalar>
class AccumulatedError {
public:
    /// start: the first true position, at which the estimate is taken to be right.
    /// azimuth_form: the paper plots range and elevation by (29) but azimuth by (35), which has kappa = 2.
    AccumulatedError(KappaForm form, KappaForm azimuth_form, Loop loop, const geometry::Spherical<Scalar>& start)
        : form_(form), azimuth_form_(azimuth_form), loop_(loop), previous_(start) {}

    AccumulatedError(KappaForm form, Loop loop, const geometry::Spherical<Scalar>& start)
        : AccumulatedError(form, form, loop, start) {}

    /// The errors after the update that sees the true position `now` (azimuth and elevation continuous, not wrapped).
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

    /// beta - e_beta: the elevation that the device believes in, and divides by the cosine of.
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
