// SCAAT method: connects intake, estimator, health and report.
#pragma once

#include "core/tracking/scaat/estimator.hpp"
#include "core/tracking/scaat/health.hpp"
#include "core/tracking/scaat/horizon.hpp"
#include "core/tracking/scaat/intake.hpp"
#include "core/tracking/state/hemisphere.hpp"
#include "core/tracking/state/motion_estimate.hpp"
#include "core/tracking/tracker/tracker.hpp"

namespace tricoil::tracking::scaat {

/// Searches with the direct solver until three columns give a pose, then filters. While tracking it returns a pose for each
/// column (FDM: at the last of three, or at the first column of the next frame if one is missing). While searching it returns a
/// flagged pose per complete matrix. Outliers and restarts: README. Columns that are saturated, clipped, offset, stuck, overrun,
/// gain_changed or without reference are not used. tick(): the pose predicted to that time, coasting, stale after coast_limit.
template <typename Scalar, MeasurementModel<Scalar> Model>
class Filter : public Tracker<Scalar> {
public:
    [[nodiscard]] const State<Scalar>& motion() const { return estimator_.state(); }
    /// In the frame of corrected columns, as motion().
    [[nodiscard]] FilterState<Scalar> filter_state() const {
        return {estimator_.state(), estimator_.intensity(), estimator_.reported(estimator_.state()), is_running_ ? starts_ : 0,
                this->counters_.covariance_inflations};
    }

protected:
    using typename Tracker<Scalar>::Correction;

    Filter(const CommonParams<Scalar>& common, const ScaatParams<Scalar>& params, const Model& model,
           const Correction& correction);

private:
    using Pose = std::optional<PoseEstimate<Scalar>>;
    using Trust = typename Estimator<Scalar, Model>::Trust;

    Pose do_update(const Column<Scalar>& column, bool is_late) final;
    void do_restart(DeviceTime now) final;
    Pose do_tick(DeviceTime now) final;
    void do_set_hemisphere(const Vec3<Scalar>& towards) final;

    // Tracking: one column (TDM, or late), or the columns of a frame (FDM).
    Pose track_column(const Column<Scalar>& column);
    Pose track_frame(const Column<Scalar>& column);
    Pose end_frame(const Column<Scalar>& next);
    std::optional<SignalMatrix<Scalar>> take_into_frame(const Column<Scalar>& column);
    bool use_frame(const SignalMatrix<Scalar>& matrix);
    void use_waiting();
    bool use(const Column<Scalar>& column, const Motion<Scalar>& around, Trust trust);
    [[nodiscard]] Trust trust_of_several() const { return estimator_.history().several_refused() ? Trust::agree : Trust::none; }
    void compare_with_columns();
    [[nodiscard]] bool is_evenly_noisy() const;
    [[nodiscard]] bool is_within_gate(const StartPose<Scalar>& pose, Scalar sigma) const;
    Pose finish_measurement(bool has_matrix);

    // Acquisition and loss.
    Pose search(const Column<Scalar>& column);
    Pose acquire(const SignalMatrix<Scalar>& matrix, DeviceTime time);
    bool start(const SignalMatrix<Scalar>& matrix);
    std::optional<StartRates<Scalar>> rates_since_last_start(const StartPose<Scalar>& pose, DeviceTime time);
    void resolve_hemisphere(StartPose<Scalar>& pose, const SignalMatrix<Scalar>& matrix);
    void turn_around();
    [[nodiscard]] bool continue_side(Scalar deviation_m);
    void stop();

    [[nodiscard]] bool predict(State<Scalar>& later, Microseconds ahead, bool coasting);
    [[nodiscard]] Pose report(PoseFlags flags, Microseconds ahead, DeviceTime now);

    ScaatParams<Scalar> params_;
    Model model_;
    Intake<Scalar> intake_;
    Estimator<Scalar, Model> estimator_;
    Health<Scalar, Model> health_;
    Hemisphere<Scalar> hemisphere_;
    [[no_unique_address]] Horizon<Scalar> horizon_;
    int starts_ = 0;
    bool is_running_ = false;  // the estimator has a state that the next column continues
    bool is_vague_ = false;    // the last pose may have passed to the other side of the source
    bool is_new_ = false;      // no pose has shown its side since the start
    TimedPose<Scalar> last_start_;
    std::uint8_t sensor_ = 0;
};

}  // namespace tricoil::tracking::scaat
