// The tracker of one sensor: columns in, poses out; keeps the hemisphere and says when a pose is not to be trusted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column.hpp"
#include "core/solver/previous_measurement.hpp"
#include "core/tracking/column_check.hpp"
#include "core/tracking/hemisphere.hpp"
#include "core/tracking/motion_estimate.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/signal_matrix_assembler.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking {

/// How a pose is computed from a signal matrix. Acquisition is always direct.
enum class Method : std::uint8_t {
    direct,           // closed form, maximum likelihood
    previous,         // previous-measurement technique, pole-free
    previous_angles,  // the same in the paper's angles, with its poles
};

template <typename Scalar>
struct TrackerParams {
    Method method = Method::direct;
    int passes = 1;                                   // of the previous-measurement step per matrix
    Scalar coupling_constant = 1;                     // C, coupling units times m^3
    Vec3<Scalar> hemisphere = Vec3<Scalar>::UnitX();  // towards the half space the sensor starts in; zero: unknown
    bool confined = false;                            // to that half space, by a wall or a table: told again after every loss
    Microseconds max_column_span{0};                  // see SignalMatrixAssembler; column_span() derives it from a plan
    bool deskew = false;                              // TDM: extrapolate each column to the newest one's time
    Scalar window_s = 0;                              // length of a demodulation window, for the predicted blur
    Scalar latency_s = 0;                             // from a pose's time to its use, for the predicted error
    Scalar min_snr = 10;                              // k / sigma below which a pose is flagged (20 dB)
    Scalar max_misfit = Scalar(0.1);                  // share of the couplings' power that no dipole explains: no sensor.
                                                      // Rank-one crosstalk has 1/3; the worst real sensor seen so far 0.034
    Scalar distortion_gate = Scalar(16.27);           // chi-square of 3 degrees of freedom passed once in 1,000
    Microseconds lost_after{100'000};                 // without a valid pose
    Microseconds search_after{1'000'000};             // when lost: forget the last pose
};

/// max_column_span for a plan: FDM columns are simultaneous; three TDM slots in turn span two, and a lost one must not be
/// bridged.
Microseconds column_span(const signal::AcquisitionPlan& plan);

/// Errors (invalid_argument): coupling constant, limits or times not positive, passes outside 1-10, a hemisphere not finite.
template <typename Scalar>
Status check(const TrackerParams<Scalar>& params);

template <typename Scalar>
class Tracker {
public:
    /// `params` must pass check().
    explicit Tracker(const TrackerParams<Scalar>& params);

    /// Takes one column; a pose once it completes a signal matrix. A refused column is counted and changes nothing else.
    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);

    /// Called when time passes without columns: the last pose, flagged stale, once it is older than lost_after.
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);

    /// Points to the half space in which the sensor is now; zero makes it unknown. Refused (not_finite) if not finite.
    Status set_hemisphere(const Vec3<Scalar>& towards);

    [[nodiscard]] TrackerState state() const { return state_; }
    [[nodiscard]] const TrackerCounters& counters() const { return counters_; }

private:
    using Pose = solver::VectorPose<Scalar>;

    /// A solution in both forms: the angle method carries its unwrapped angles along.
    struct Followed {
        Pose pose;
        solver::AnglePose<Scalar> angles;
    };

    [[nodiscard]] std::optional<Rejection> why_refused(const Column<Scalar>& column);
    [[nodiscard]] Result<Followed> follow(const Mat3<Scalar>& x) const;
    [[nodiscard]] Result<Followed> acquire(const SignalMatrix<Scalar>& matrix);
    void doubt_history(PoseEstimate<Scalar>& estimate);
    [[nodiscard]] Scalar misfit_squared(const Mat3<Scalar>& x, const Pose& pose) const;
    void judge(const SignalMatrix<Scalar>& matrix, const Pose& pose, PoseEstimate<Scalar>& estimate) const;
    void predict_error(const SignalMatrix<Scalar>& matrix, error_model::SolverForm form, PoseEstimate<Scalar>& estimate);
    void advance(bool valid, DeviceTime time);

    TrackerParams<Scalar> params_;
    SignalMatrixAssembler<Scalar> assembler_;
    MotionEstimate<Scalar> motion_;
    TrackerState state_ = TrackerState::searching;
    Followed last_;
    bool has_last_ = false;
    TimeBase time_base_;
    Hemisphere<Scalar> hemisphere_;
    int doubtful_ = 0;  // columns still to come until no older one is extrapolated from that was part of a bad matrix
    DeviceTime last_valid_{};
    PoseEstimate<Scalar> last_estimate_;
    TrackerCounters counters_;
};

static_assert(sizeof(Tracker<float>) <= 1600, "one sensor's tracker without a filter, in float");

extern template Status check(const TrackerParams<float>&);
extern template Status check(const TrackerParams<double>&);
extern template class Tracker<float>;
extern template class Tracker<double>;

}  // namespace tricoil::tracking
