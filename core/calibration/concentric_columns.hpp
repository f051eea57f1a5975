// A calibration applied to one column at a time, ahead of trackers that know ideal triads only.
#pragma once

#include <Eigen/LU>
#include <cmath>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

/// For triads whose coils share one place, and whose source coils are square to each other: phases, gains, signs, the sensor
/// coils' angles and the source's attitude come out exactly. Coils of the source that are not square cannot be undone here: their
/// columns are measured at different times.
template <typename Scalar>
class ConcentricColumns {
public:
    /// What may be left out of account: at half a metre it moves a pose by some 0.5 mm and 1 mrad.
    static constexpr Scalar kSquareness = Scalar(1e-3);  // cosine between two source coils
    static constexpr Scalar kOffset_m = Scalar(5e-4);    // of a coil from its triad's place
    static constexpr Scalar kOctupole = Scalar(1e-4);    // m^2, of a coil's finite size

    /// Errors: those of check(); invalid_argument, with the reason, for a calibration of another kind.
    static Result<ConcentricColumns> make(const Calibration<Scalar>& c) {
        if (const Status status = check(c); !status.ok()) {
            return status;
        }
        if (largest(c.model.source_offset_m) > kOffset_m || largest(c.model.sensor_offset_m) > kOffset_m) {
            return Status{StatusCode::invalid_argument, "its coils lie more than 0.5 mm off their triad's place"};
        }
        if (largest(c.model.source_octupole_m2) > kOctupole || largest(c.model.sensor_octupole_m2) > kOctupole) {
            return Status{StatusCode::invalid_argument, "its coils are too large to be taken for points"};
        }
        ConcentricColumns columns;
        columns.c_ = c;
        columns.gain_ = c.model.source_moment.colwise().norm();
        columns.axes_ = c.model.source_moment * columns.gain_.cwiseInverse().asDiagonal();
        const Mat3<Scalar> cosines = columns.axes_.transpose() * columns.axes_;
        if (largest((cosines - Mat3<Scalar>::Identity()).eval()) > kSquareness) {
            return Status{StatusCode::invalid_argument, "its source coils are not square to each other within 1 mrad"};
        }
        if (columns.axes_.determinant() < 0) {  // a reversed coil: of the three, the one that points most backwards
            Eigen::Index reversed = 0;
            columns.axes_.diagonal().minCoeff(&reversed);
            columns.axes_.col(reversed) *= Scalar(-1);
            columns.gain_(reversed) *= Scalar(-1);
        }
        columns.sensor_ = c.model.sensor_sensitivity.transpose().inverse();
        return columns;
    }

    /// Column j (0-2) as ideal triads with C = 1 would couple; in phase, in quadrature and its standard deviations.
    void apply(int j, Vec3<Scalar>& in_phase, Vec3<Scalar>& quadrature, Vec3<Scalar>& sigma) const {
        const auto cosine = c_.phase_rad.array().cos();
        const auto sine = c_.phase_rad.array().sin();
        const Vec3<Scalar> along = cosine * in_phase.array() + sine * quadrature.array();
        const Vec3<Scalar> across = cosine * quadrature.array() - sine * in_phase.array();
        in_phase = sensor_ * along / gain_(j);
        quadrature = sensor_ * across / gain_(j);
        const Vec3<Scalar> variance = sensor_.cwiseAbs2() * sigma.cwiseAbs2();
        sigma = variance.cwiseSqrt() / std::abs(gain_(j));
    }

    /// The source coils' axes: v_source = axes v_coils. Poses come out in the coils' own axes.
    [[nodiscard]] const Mat3<Scalar>& axes() const { return axes_; }

private:
    template <typename Derived>
    static Scalar largest(const Eigen::MatrixBase<Derived>& m) {
        return m.cwiseAbs().maxCoeff();
    }

    Calibration<Scalar> c_;
    Vec3<Scalar> gain_ = Vec3<Scalar>::Ones();
    Mat3<Scalar> axes_ = Mat3<Scalar>::Identity();
    Mat3<Scalar> sensor_ = Mat3<Scalar>::Identity();  // N^-T
};

}  // namespace tricoil::calibration
