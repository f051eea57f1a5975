// Base of the trackers that solve each complete signal matrix: from columns to the flagged pose.
#pragma once

#include "core/solver/previous_measurement.hpp"
#include "core/tracking/front/column_motion.hpp"
#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "core/tracking/judge/noise_check.hpp"
#include "core/tracking/judge/quadrature_check.hpp"
#include "core/tracking/state/hemisphere.hpp"
#include "core/tracking/state/motion_estimate.hpp"
#include "core/tracking/tracker/tracker.hpp"

namespace tricoil::tracking {

/// A pose is unconfirmed unless it continues the one before it, and in TDM with deskew unless the motion is known from earlier
/// columns. Motion and misfit widen its covariance.
/// A method may compute the pose by a step from the last pose. Without a step, or if it fails, the direct solver computes the
/// pose and Hemisphere decides its side. tick(): the last pose, flagged stale, if it is older than lost_after.
template <typename Scalar>
class MatrixTracker : public Tracker<Scalar> {
protected:
    using Pose = solver::VectorPose<Scalar>;
    using typename Tracker<Scalar>::Correction;

    /// Form and passes of the method's step, for the error budget.
    struct Step {
        error_model::SolverForm form = error_model::SolverForm::direct;
        int passes = 1;
    };

    MatrixTracker(const CommonParams<Scalar>& params, bool deskew, Step step, const Correction& correction);

    void do_set_hemisphere(const Vec3<Scalar>& towards) override;

private:
    /// Step of the method from the last pose. not_ready: the method has no step.
    virtual Result<Pose> do_step(const Mat3<Scalar>& /*x*/, const Pose& /*last*/) {
        return Status{StatusCode::not_ready, "every pose is direct"};
    }
    /// Changes the pose of `columns`, its covariance and flags. A method that keeps poses also overrides do_set_hemisphere().
    virtual void do_refine(const SignalMatrixAssembler<Scalar>& /*columns*/, PoseEstimate<Scalar>& /*estimate*/) {}

    std::optional<PoseEstimate<Scalar>> do_update(const Column<Scalar>& column, bool is_late) final;
    void do_restart(DeviceTime now) final;
    std::optional<PoseEstimate<Scalar>> do_tick(DeviceTime now) final;

    [[nodiscard]] Result<Pose> step(const Mat3<Scalar>& x);
    [[nodiscard]] Result<Pose> acquire(const SignalMatrix<Scalar>& matrix);
    void flag_recent_faults(PoseEstimate<Scalar>& estimate, bool jumped);
    [[nodiscard]] Result<Pose> step_near_metal(const Mat3<Scalar>& x);
    [[nodiscard]] Scalar misfit_squared(const Mat3<Scalar>& x, const Pose& pose) const;
    void fill_estimate(const SignalMatrix<Scalar>& matrix, const Pose& pose, bool stepped, PoseEstimate<Scalar>& estimate);
    [[nodiscard]] Scalar linearization_share(const Pose& pose) const;
    [[nodiscard]] bool is_continuation(const PoseEstimate<Scalar>& estimate) const;
    bool judge_quadrature(const SignalMatrix<Scalar>& matrix, Scalar strength, PoseFlags flags);
    void predict_error(const SignalMatrix<Scalar>& matrix, Step step, PoseEstimate<Scalar>& estimate);
    void forget_column_motion();

    bool deskew_;
    Step step_;
    SignalMatrixAssembler<Scalar> assembler_;
    MotionEstimate<Scalar> motion_;
    Pose last_;
    Hemisphere<Scalar> hemisphere_;
    ColumnMotion<Scalar> column_motion_;
    std::array<typename ColumnMotion<Scalar>::Curvature, kSourceCoils> curvatures_{};
    NoiseCheck<Scalar> noise_;
    Misfit<Scalar> misfit_;
    QuadratureCheck<Scalar> quadrature_;
    /// The last solved pose without a fault flag, valid or not.
    struct {
        Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
        Scalar deviation_m = 0;
        DeviceTime time{};
        bool exists = false;
    } solved_;
    int unconfirmed_ = 0;  // columns to come until deskew no longer uses columns of a bad matrix
    PoseEstimate<Scalar> last_estimate_;
};

extern template class MatrixTracker<float>;
extern template class MatrixTracker<double>;

}  // namespace tricoil::tracking
