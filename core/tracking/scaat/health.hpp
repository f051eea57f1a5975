// Signal health: flags and diagnostics of a complete signal matrix. Needs no motion model.
#pragma once

#include <cmath>

#include "core/tracking/pose_flags.hpp"
#include "core/tracking/scaat/measurement_model.hpp"
#include "core/tracking/scaat/signal_curvature.hpp"
#include "core/tracking/signal_matrix_assembler.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking::scaat {

/// Computes flags, distortion and signal-to-noise ratio of a signal matrix. Parameters and model must outlive it.
template <typename Scalar, MeasurementModel<Scalar> Model>
class Health {
public:
    Health(const CommonParams<Scalar>& params, const Model& model)
        : params_(params), model_(model), accepted_(params.max_column_span, true) {}

    /// Pose of a matrix, found near a state or, without one, from the matrix alone. Not inlined, to save stack.
    [[gnu::noinline]] Result<StartPose<Scalar>> examine(const SignalMatrix<Scalar>& matrix, const State<Scalar>* beside) {
        const auto pose =
            beside != nullptr ? model_.near(matrix.x, beside->position_m, beside->q_source_sensor) : model_.start(matrix.x);
        flags_ = {};
        distortion_chi_square_ = 0;
        snr_db_ = 0;
        x_ = matrix.x;
        if (pose.ok()) {
            judge(matrix, *pose, beside != nullptr ? signal_curvature(*beside) : Scalar(0));
        } else {
            flags_.set(PoseFlag::no_sensor);
        }
        return pose;
    }

    /// Adds a column that passed the gate. Once per frame the deskewed matrix of such columns is examined.
    void take(const Column<Scalar>& column, const State<Scalar>& state, bool may_deskew) {
        const auto matrix = accepted_.add(column);
        if (matrix && may_deskew && ++columns_since_ >= kSourceCoils) {
            columns_since_ = 0;
            (void)examine(*matrix, &state);
        }
    }

    /// Start of the filter: the motion is unknown.
    void start() {
        accepted_.clear();
        columns_since_ = 0;
        blur_variance_ = 0;
    }
    void forget_columns() { accepted_.clear(); }

    [[nodiscard]] PoseFlags flags() const { return flags_; }
    [[nodiscard]] bool is_sensor() const { return !flags_.has_any({PoseFlag::no_sensor, PoseFlag::wrong_handedness}); }
    [[nodiscard]] Scalar distortion_chi_square() const { return distortion_chi_square_; }
    [[nodiscard]] Scalar snr_db() const { return snr_db_; }
    [[nodiscard]] const Mat3<Scalar>& signal_matrix() const { return x_; }
    /// Variance of a coupling due to blur, coupling units squared.
    [[nodiscard]] Scalar blur_variance() const { return blur_variance_; }

private:
    /// curvature: second time derivative of the couplings relative to their strength, 1/s^2.
    void judge(const SignalMatrix<Scalar>& matrix, const StartPose<Scalar>& pose, Scalar curvature) {
        const Scalar bend = pose.strength * curvature;
        const Scalar remainder = bend * deskew_remainder_s2(seconds_as<Scalar>(params_.max_column_span));
        const Scalar blur = bend * blur_s2(params_.window_s);
        blur_variance_ = blur * blur;
        const Scalar variance = matrix.sigma * matrix.sigma + remainder * remainder + blur_variance_;
        const Scalar snr = pose.strength / matrix.sigma;
        distortion_chi_square_ = pose.misfit_squared / variance;
        snr_db_ = 20 * std::log10(snr);
        const bool significant = distortion_chi_square_ > params_.distortion_gate;
        flags_.set_if(!pose.right_handed, PoseFlag::wrong_handedness);
        flags_.set_if(snr < params_.min_snr, PoseFlag::low_signal);
        flags_.set_if(significant, PoseFlag::distorted);
        flags_.set_if(significant && pose.misfit_squared > params_.max_misfit * matrix.x.squaredNorm(), PoseFlag::no_sensor);
    }

    const CommonParams<Scalar>& params_;
    const Model& model_;
    SignalMatrixAssembler<Scalar> accepted_;  // deskewed
    int columns_since_ = 0;                   // columns since the last call of examine()
    PoseFlags flags_;
    Scalar distortion_chi_square_ = 0;
    Scalar snr_db_ = 0;
    Mat3<Scalar> x_ = Mat3<Scalar>::Zero();
    Scalar blur_variance_ = 0;
};

}  // namespace tricoil::tracking::scaat
