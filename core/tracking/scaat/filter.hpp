// The motion-proof tracker of one sensor: every column at its own time (single constraint at a time, Welch and Bishop 1997).
#pragma once

#include <optional>

#include "core/tracking/column_check.hpp"
#include "core/tracking/hemisphere.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/scaat/acquisition.hpp"
#include "core/tracking/scaat/coil_record.hpp"
#include "core/tracking/scaat/noise_check.hpp"
#include "core/tracking/scaat/signal_curvature.hpp"
#include "core/tracking/time_base.hpp"

namespace tricoil::tracking::scaat {

/// Searches with the direct solver until three columns give a pose, then filters. A column that contradicts the prediction is
/// refused and the pose flagged unconfirmed; three in a row, or three of one state in a row, mean that the filter was left
/// behind: it starts anew from the last three columns. Not used: columns saturated, clipped, offset, stuck, overrun or without
/// reference.
template <typename Scalar, MeasurementModel<Scalar> Model = ConcentricMeasurement<Scalar>>
class Filter {
public:
    /// Errors (invalid_argument): those of the parameters and of the model.
    [[nodiscard]] static Status check(const Params<Scalar>& params, const Model& model);

    /// `params` and `model` must pass check().
    Filter(const Params<Scalar>& params, const Model& model);

    /// Takes one column, in order or late by at most max_lateness; a pose for each while tracking (FDM: for the last of three, or
    /// with the next frame's first if one did not come), and a flagged one per complete matrix while searching. A refused column
    /// is counted and changes nothing else.
    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column);

    /// Called when a column did not come: the pose predicted to `now`, flagged coasting, and stale beyond coast_limit.
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now);

    /// Points to the half space in which the sensor is now; zero makes it unknown. Refused (not_finite) if not finite.
    Status set_hemisphere(const Vec3<Scalar>& towards);

    /// Pose and covariance `ahead_s` (0 to 10 s) after the newest column, at the present rates; as PoseEstimate does it.
    [[nodiscard]] State<Scalar> predicted(Scalar ahead_s) const;

    [[nodiscard]] TrackerState state() const { return mode_; }
    [[nodiscard]] const State<Scalar>& motion() const { return state_; }
    [[nodiscard]] Intensity<Scalar> intensity() const;
    /// Windowed mean of squared innovations per degree of freedom; expectation 1.
    [[nodiscard]] Scalar consistency() const { return consistency_; }
    [[nodiscard]] const TrackerCounters& counters() const { return counters_; }

private:
    /// What the last whole frame's signal matrix said; needs no motion model.
    struct Health {
        PoseFlags flags;
        Scalar distortion_chi_square = 0;
        Scalar snr_db = 0;
        Mat3<Scalar> x = Mat3<Scalar>::Zero();
    };

    [[nodiscard]] std::optional<Rejection> why_refused(const Column<Scalar>& column, bool& late);
    void forget();
    std::optional<PoseEstimate<Scalar>> track(const Column<Scalar>& column);
    [[nodiscard]] State<Scalar> moved_on(Microseconds ahead) const;
    std::optional<PoseEstimate<Scalar>> follow_frame(const Column<Scalar>& column);
    std::optional<PoseEstimate<Scalar>> end_frame(const Column<Scalar>& next);
    std::optional<SignalMatrix<Scalar>> take_into_frame(const Column<Scalar>& column);
    std::optional<PoseEstimate<Scalar>> judge(const std::optional<SignalMatrix<Scalar>>& raw);
    [[nodiscard]] bool in_frames() const { return params_.max_column_span.count() == 0; }
    std::optional<PoseEstimate<Scalar>> search(const Column<Scalar>& column);
    std::optional<PoseEstimate<Scalar>> begin(const SignalMatrix<Scalar>& matrix, DeviceTime time);
    void use_pending();
    bool use_frame(const SignalMatrix<Scalar>& matrix);
    [[nodiscard]] bool is_evenly_noisy() const;
    [[nodiscard]] bool is_beside(const StartPose<Scalar>& pose, Scalar sigma) const;
    bool use(const Column<Scalar>& column, const Motion<Scalar>& around, bool trusted);
    void open(Scalar factor);
    void adapt(const Innovation<Scalar>& innovation, const Vec3<Scalar>& whitened);
    bool start(const SignalMatrix<Scalar>& matrix);
    [[nodiscard]] Result<StartPose<Scalar>> examine(const SignalMatrix<Scalar>& matrix, bool beside);
    void resolve_hemisphere(StartPose<Scalar>& pose, const SignalMatrix<Scalar>& matrix);
    void cover_blur(PoseEstimate<Scalar>& estimate) const;
    void reset_adaptation();
    void lose(DeviceTime time);
    [[nodiscard]] std::optional<PoseEstimate<Scalar>> report(PoseFlags flags, Microseconds ahead);
    [[nodiscard]] error_model::ErrorBudget<Scalar> expected_error(const State<Scalar>& state,
                                                                  const Mat6<Scalar>& covariance) const;

    static constexpr int kSettlingColumns = 6;   // until velocity is known: two of each state
    static constexpr int kLearningColumns = 24;  // until its corrections tell of accelerations
    // Over the recorded motions squared errors are 0.9 to 1.0 of the filter's own covariance, and a second of motion is only some
    // twenty independent errors: users are told a little more rather than a little less.
    static constexpr double kMargin = 1.1;
    // From here on a column weighs less, its variance by the third power of the excess: chosen for outliers of 5 to 15 sigma in
    // one column of 20, which are hidden in motion. It costs 3 % of accuracy where there are none.
    static constexpr double kDoubtful = 9;  // squared innovation, 3 degrees of freedom: passed once in 34
    // An outlier that just passes the gate moves the pose by as many of its sigmas: said in the covariance until others outvote
    // it.
    static constexpr double kSurprising = 6;  // squared innovation, 3 degrees of freedom: passed once in 9
    static constexpr double kSurpriseKept = 0.96;
    // Most of the blur looks like a pose and changes slowly: nothing to hold against a column. The share that does neither, over
    // the recorded motions and the paper's example III; more makes the filter trail behind the direct pose, less makes it refuse.
    static constexpr double kRestlessBlur = 0.1;
    static constexpr int kMostOpenings = 4;  // for one column

    Params<Scalar> params_;
    Model model_;
    SignalMatrixAssembler<Scalar> raw_;       // every usable column: to start from
    SignalMatrixAssembler<Scalar> accepted_;  // deskewed, what the gate passed: to judge health by
    TrackerState mode_ = TrackerState::searching;
    State<Scalar> state_;
    ProcessNoiseState<Scalar> process_;
    Scalar consistency_ = 1;
    NoiseCheck<Scalar> noise_;
    Scalar surprise_ = 0;  // of recent columns: squared innovation over kSurprising, fading
    Health health_;
    Scalar blur_variance_ = 0;  // of a coupling, because windows are not points; coupling units squared
    TimeBase time_base_;
    Hemisphere<Scalar> hemisphere_;
    CoilRecord record_;
    int settled_ = 0;       // columns used since the start, up to kLearningColumns
    unsigned pending_ = 0;  // FDM: coils (bit each) whose columns of this instant have come and wait for the others
    std::array<PoseFlags, kSourceCoils> flags_of_state_{};  // of the newest column of each state
    int since_health_ = 0;
    DeviceTime last_used_{};
    std::uint8_t sensor_ = 0;
    TrackerCounters counters_;
};

extern template class Filter<float, ConcentricMeasurement<float>>;
extern template class Filter<double, ConcentricMeasurement<double>>;
static_assert(sizeof(Filter<float>) <= 2560, "one sensor's filter in float, of 32 KiB RAM for four");

}  // namespace tricoil::tracking::scaat
