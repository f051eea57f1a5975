// Signal health: flags and diagnostics of a complete signal matrix. Needs no motion model.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/tracking/front/column_motion.hpp"
#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "core/tracking/judge/quadrature_check.hpp"
#include "core/tracking/pose_flags.hpp"
#include "core/tracking/scaat/measurement_model.hpp"
#include "core/tracking/scaat/signal_curvature.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking::scaat {

/// Computes flags, distortion and signal-to-noise ratio of a signal matrix. Parameters and model must outlive it.
template <typename Scalar, MeasurementModel<Scalar> Model>
class Health {
public:
    Health(const CommonParams<Scalar>& params, const Model& model)
        : params_(params), model_(model), accepted_(params.max_column_span, true), motion_(params) {}

    /// Pose of a matrix, found near a state or, without one, from the matrix alone. Not inlined, to save stack.
    [[gnu::noinline]] Result<StartPose<Scalar>> examine(const SignalMatrix<Scalar>& matrix, const State<Scalar>* beside) {
        const auto pose =
            beside != nullptr ? model_.near(matrix.x, beside->position_m, beside->q_source_sensor) : model_.start(matrix.x);
        flags_ = {};
        distortion_chi_square_ = 0;
        snr_db_ = 0;
        x_ = matrix.x;
        residual_.setZero();
        if (pose.ok()) {
            judge(matrix, *pose, beside);
        } else {
            flags_.set(PoseFlag::no_sensor);
        }
        return pose;
    }

    /// Adds a column that passed the gate. True once per frame: then the matrix of accepted() is to be examined.
    bool take(const Column<Scalar>& column, bool may_deskew) {
        if (!accepted_.note(column) || !may_deskew || ++columns_since_ < kSourceCoils) {
            return false;
        }
        columns_since_ = 0;
        return true;
    }

    [[nodiscard]] const SignalMatrixAssembler<Scalar>& accepted() const { return accepted_; }

    void note(const Column<Scalar>& column) { (void)motion_.add(column); }

    void start() {
        accepted_.clear();
        columns_since_ = 0;
        blur_variance_ = 0;
    }
    void forget_columns() { accepted_.clear(); }
    void forget_times() {
        accepted_.clear();
        motion_.clear();
    }

    [[nodiscard]] PoseFlags flags() const { return flags_; }
    [[nodiscard]] bool is_sensor() const { return !flags_.has_any({PoseFlag::no_sensor, PoseFlag::wrong_handedness}); }
    [[nodiscard]] Scalar distortion_chi_square() const { return distortion_chi_square_; }
    [[nodiscard]] Scalar snr_db() const { return snr_db_; }
    [[nodiscard]] const Mat3<Scalar>& signal_matrix() const { return x_; }
    /// Variance of a coupling for the pose of the last matrix: noise, calibrated coils, motion and misfit. Coupling units
    /// squared.
    [[nodiscard]] Scalar pose_variance() const { return pose_variance_; }
    /// Variance of a coupling due to blur, coupling units squared.
    [[nodiscard]] Scalar blur_variance() const { return blur_variance_; }
    /// Variance of a coupling due to a significant misfit of the signal matrix with which the filter started. Motion between its
    /// columns, or metal, causes this misfit. Zero after the next matrix that gives a pose.
    [[nodiscard]] Scalar start_variance() const { return start_variance_; }
    /// Part of column j of the last matrix that neither a pose nor noise and motion explain. Coupling units.
    [[nodiscard]] auto residual(int j) const { return residual_.col(j); }
    /// Variance of a coupling due to errors of the calibrated coils that residual() does not contain, coupling units squared.
    [[nodiscard]] Scalar unremoved_variance() const { return unremoved_variance_; }
    /// Variance of a coupling that misfit and quadrature suggest, coupling units squared, and the coupling strength.
    [[nodiscard]] Scalar misfit_variance() const { return std::max(misfit_.variance(), quadrature_.variance()); }
    /// Variance of a coupling for the covariance of the pose: of misfit and of the calibrated coils, coupling units squared.
    [[nodiscard]] Scalar systematic_variance() const {
        return std::max(misfit_.covered_variance(), quadrature_.variance()) + floor_variance();
    }
    [[nodiscard]] Scalar strength() const { return strength_; }

private:
    /// beside: the state, or null at a start.
    void judge(const SignalMatrix<Scalar>& matrix, const StartPose<Scalar>& pose, const State<Scalar>* beside) {
        const bool moving = beside == nullptr || !motion_.known();  // possibly: the misfit may be due to motion
        const Scalar blur = beside == nullptr ? Scalar(0) : pose.strength * signal_curvature(*beside) * blur_s2(params_.window_s);
        blur_variance_ = blur * blur;
        // Motion from the columns, not from the state: a state that mistakes metal for motion would explain its misfit.
        const Scalar noise = matrix.sigma * matrix.sigma;
        const Scalar still = noise + params_.calibration_variance(pose.strength);
        const Scalar moved = motion_.error_variance(matrix, params_.window_s);
        const Scalar variance = still + moved;
        pose_variance_ = variance + pose.misfit_squared / 3;
        const Scalar snr = pose.strength / matrix.sigma;
        distortion_chi_square_ = pose.misfit_squared / variance;
        snr_db_ = 20 * std::log10(snr);
        const bool significant = distortion_chi_square_ > params_.distortion_gate;
        flags_.set_if(!pose.right_handed, PoseFlag::wrong_handedness);
        flags_.set_if(snr < params_.min_snr, PoseFlag::low_signal);
        if (beside != nullptr) {
            flags_.set_if(significant, moving ? PoseFlag::unconfirmed : PoseFlag::distorted);
        }
        flags_.set_if(significant && pose.misfit_squared > params_.max_misfit * matrix.x.squaredNorm(), PoseFlag::no_sensor);
        strength_ = pose.strength;
        start_variance_ = beside == nullptr && significant ? pose.misfit_squared / 3 : Scalar(0);
        const bool is_fault = !is_sensor();  // neither motion nor metal
        if (is_fault) {
            motion_.clear();
            misfit_ = {};
        }
        const bool is_judged = !moving && !is_fault;
        if (is_judged) {
            const Scalar direct_m = position_deviation(pose.strength, pose.position_m.norm(), matrix.sigma);
            // Gain of the filter for a pose: its variance, errors of the coils included, over that of the noise of one matrix.
            const Scalar gain = beside->covariance.template topLeftCorner<3, 3>().trace() / (direct_m * direct_m);
            const Scalar share = std::min(gain * gain, Scalar(1));
            misfit_.add(pose.misfit_squared, variance, still, params_.distortion_gate, matrix.newest, share);
            flags_.set_if(quadrature_.add(matrix, pose.strength, motion_, params_, share), PoseFlag::distorted);
        } else {
            quadrature_.clear();
        }
        const Scalar unexplained = pose.misfit_squared / (noise + moved);  // part of it may be an error of the calibrated coils
        const Scalar removed =
            unexplained > params_.distortion_gate && is_judged ? 1 - params_.distortion_gate / unexplained : Scalar(0);
        if (removed > 0) {
            find_residual(pose, removed);
        }
        const Scalar left = (1 - removed) * (1 - removed) * pose.misfit_squared / 3;
        unremoved_variance_ = std::clamp(left - noise, Scalar(0), floor_variance());
    }

    /// The residual of the columns at `pose`, times `weight`. It lies in the directions that do not depend on the pose, so that
    /// columns without it give the same pose.
    void find_residual(const StartPose<Scalar>& pose, Scalar weight) {
        for (int j = 0; j < kSourceCoils; ++j) {
            residual_.col(j) = weight * (x_.col(j) - model_.column(pose.position_m, pose.attitude, j).column);
        }
    }

    [[nodiscard]] Scalar floor_variance() const { return tracking::floor_variance(params_, strength_); }

    const CommonParams<Scalar>& params_;
    const Model& model_;
    SignalMatrixAssembler<Scalar> accepted_;  // deskewed
    int columns_since_ = 0;                   // columns since the last call of examine()
    PoseFlags flags_;
    Scalar distortion_chi_square_ = 0;
    Scalar snr_db_ = 0;
    Mat3<Scalar> x_ = Mat3<Scalar>::Zero();
    Scalar pose_variance_ = 0;
    Scalar blur_variance_ = 0;
    Scalar start_variance_ = 0;
    Scalar strength_ = 1;
    Scalar unremoved_variance_ = 0;
    Mat3<Scalar> residual_ = Mat3<Scalar>::Zero();
    ColumnMotion<Scalar> motion_;
    Misfit<Scalar> misfit_;
    QuadratureCheck<Scalar> quadrature_;
};

}  // namespace tricoil::tracking::scaat
