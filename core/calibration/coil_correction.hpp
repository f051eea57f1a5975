// Calibration in the form that trackers apply: to each column before its use and to each position before its report.
#pragma once

#include <cmath>
#include <complex>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

/// Two kinds. ideal_triads(): corrects pick-up, phases, gains, signs, sensor coil angles and the source's attitude column by
/// column. It is for trackers with the concentric model, which add the coupling of metal at rest themselves. phases(): corrects
/// pick-up and phases only; the tracker's general model contains the rest.
template <typename Scalar>
class CoilCorrection {
public:
    /// Deviations that ideal_triads() neglects. At 0.5 m they change a pose by about 0.5 mm and 1 mrad.
    static constexpr Scalar kSquareness = Scalar(1e-3);  // cosine between two source coils
    static constexpr Scalar kOffset_m = Scalar(5e-4);    // of a coil from its triad's centre
    static constexpr Scalar kOctupole = Scalar(1e-4);    // m^2, octupole of a coil

    /// For concentric triads with orthogonal source coils. Non-orthogonal source coils cannot be corrected here, because their
    /// columns are measured at different times. Errors: those of check(); invalid_argument, with the reason, for any other
    /// calibration.
    static Result<CoilCorrection> ideal_triads(const Calibration<Scalar>& c) {
        if (const Status status = check(c); !status.ok()) {
            return status;
        }
        if (largest(c.model.source_offset_m) > kOffset_m || largest(c.model.sensor_offset_m) > kOffset_m) {
            return Status{StatusCode::invalid_argument, "coil offsets exceed 0.5 mm"};
        }
        if (largest(c.model.source_octupole_m2) > kOctupole || largest(c.model.sensor_octupole_m2) > kOctupole) {
            return Status{StatusCode::invalid_argument, "coils are too large for the dipole model"};
        }
        CoilCorrection correction = phases(c);
        Vec3<Scalar>& gain = correction.gain_;
        Mat3<Scalar>& axes = correction.axes_;
        gain = c.model.source_moment.colwise().norm();
        axes = c.model.source_moment * gain.cwiseInverse().asDiagonal();
        const Mat3<Scalar> cosines = axes.transpose() * axes;
        if (largest(cosines - Mat3<Scalar>::Identity()) > kSquareness) {
            return Status{StatusCode::invalid_argument, "source coils are not orthogonal within 1 mrad"};
        }
        if (axes.determinant() < 0) {  // a reversed coil: the one whose axis points most in the negative direction
            Index reversed = 0;
            axes.diagonal().minCoeff(&reversed);
            axes.col(reversed) *= Scalar(-1);
            gain(reversed) *= Scalar(-1);
        }
        correction.sensor_ = c.model.sensor_sensitivity.transpose().inverse();
        correction.has_own_axes_ = true;
        for (const field::InducedDipole<Scalar>& dipole : c.model.surroundings) {
            (void)correction.surroundings_.push_back(
                {axes.transpose() * dipole.position_m, axes.transpose() * dipole.moment * gain.cwiseInverse().asDiagonal()});
        }
        return correction;
    }

    /// `c` must pass check().
    static CoilCorrection phases(const Calibration<Scalar>& c) {
        CoilCorrection correction;
        correction.phase_rad_ = c.phase_rad;
        correction.output_linear_ = c.output_linear;
        correction.output_offset_m_ = c.output_offset_m;
        correction.misfit_floor_ = c.misfit_floor;
        correction.quadrature_floor_ = c.quadrature_floor;
        correction.pick_up_ = c.pick_up;
        correction.errors_ = c.errors;
        correction.low_band_ = c.low_band;
        return correction;
    }

    /// Corrects column j (0-2): in phase, quadrature and standard deviations. After ideal_triads() the result has C = 1.
    void correct_column(int j, Vec3<Scalar>& in_phase, Vec3<Scalar>& quadrature, Vec3<Scalar>& sigma) const {
        pick_up_.remove(j, in_phase, quadrature);
        correct_coils(j, in_phase, quadrature, sigma);
    }

    /// Its standard deviations alone.
    void correct_sigma(int j, Vec3<Scalar>& sigma) const {
        const Vec3<Scalar> variance = sensor_.cwiseAbs2() * sigma.cwiseAbs2();
        sigma = variance.cwiseSqrt() / std::abs(gain_(j));
    }

    /// correct_column() for a column of the low band, which first becomes one of the high band. Only in double.
    void correct_low_column(int j, Vec3<Scalar>& in_phase, Vec3<Scalar>& quadrature, Vec3<Scalar>& sigma) const {
        low_band_.pick_up.remove(j, in_phase, quadrature);
        for (Index i = 0; i < in_phase.size(); ++i) {
            const Scalar phase_rad = phase_rad_(i, j) - low_band_.phase_rad(i, j);
            const auto high = std::polar(1 / low_band_.ratio(i, j), phase_rad) * std::complex<Scalar>(in_phase(i), quadrature(i));
            in_phase(i) = high.real();
            quadrature(i) = high.imag();
            sigma(i) /= low_band_.ratio(i, j);
        }
        correct_coils(j, in_phase, quadrature, sigma);
    }

    /// Axes of the corrected columns: v_source = axes v_coils. Identity after phases().
    [[nodiscard]] const Mat3<Scalar>& axes() const { return axes_; }
    [[nodiscard]] bool has_own_axes() const { return has_own_axes_; }
    [[nodiscard]] Scalar misfit_floor() const { return misfit_floor_; }
    [[nodiscard]] Scalar quadrature_floor() const { return quadrature_floor_; }
    /// Standard deviation of the pick-up in a corrected coupling: root mean square over the nine.
    [[nodiscard]] Scalar pick_up_sigma() const { return pick_up_.sigma * sensor_.norm() * gain_.cwiseInverse().norm() / 3; }
    [[nodiscard]] const CoilErrors<Scalar>& errors() const { return errors_; }
    /// Then trackers do not judge quadratures.
    void ignore_quadrature() { quadrature_floor_ = 1; }
    [[nodiscard]] const LowBand<Scalar>& low_band() const { return low_band_; }
    /// Metal at rest in the frame and units of the corrected columns. Empty after phases().
    [[nodiscard]] const field::InducedDipoles<Scalar>& surroundings() const { return surroundings_; }

    /// Optional output correction in the source frame: an affine map of positions, and its derivative.
    [[nodiscard]] Vec3<Scalar> corrected_position(const Vec3<Scalar>& position_m) const {
        return output_linear_ * position_m + output_offset_m_;
    }
    [[nodiscard]] const Mat3<Scalar>& output_linear() const { return output_linear_; }
    [[nodiscard]] bool corrects_output() const { return !output_linear_.isIdentity(0) || !output_offset_m_.isZero(0); }

private:
    void correct_coils(int j, Vec3<Scalar>& in_phase, Vec3<Scalar>& quadrature, Vec3<Scalar>& sigma) const {
        const Vec3<Scalar> cosine = phase_rad_.col(j).unaryExpr([](Scalar phase) { return std::cos(phase); });
        const Vec3<Scalar> sine = phase_rad_.col(j).unaryExpr([](Scalar phase) { return std::sin(phase); });
        const Vec3<Scalar> along = cosine.cwiseProduct(in_phase) + sine.cwiseProduct(quadrature);
        const Vec3<Scalar> across = cosine.cwiseProduct(quadrature) - sine.cwiseProduct(in_phase);
        in_phase = sensor_ * along / gain_(j);
        quadrature = sensor_ * across / gain_(j);
        correct_sigma(j, sigma);
    }

    template <typename Derived>
    static Scalar largest(const Dense<Derived>& m) {
        return m.cwiseAbs().maxCoeff();
    }

    Mat3<Scalar> phase_rad_ = Mat3<Scalar>::Zero();
    Vec3<Scalar> gain_ = Vec3<Scalar>::Ones();
    Mat3<Scalar> axes_ = Mat3<Scalar>::Identity();
    Mat3<Scalar> sensor_ = Mat3<Scalar>::Identity();  // N^-T
    bool has_own_axes_ = false;
    Mat3<Scalar> output_linear_ = Mat3<Scalar>::Identity();
    Vec3<Scalar> output_offset_m_ = Vec3<Scalar>::Zero();
    Scalar misfit_floor_ = 0;
    Scalar quadrature_floor_ = 1;
    PickUp<Scalar> pick_up_;
    CoilErrors<Scalar> errors_;
    field::InducedDipoles<Scalar> surroundings_;
    [[no_unique_address]] LowBand<Scalar> low_band_;
};

}  // namespace tricoil::calibration
