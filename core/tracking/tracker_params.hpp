// Parameters of a tracker: common ones and those of the selected method.
#pragma once

#include <variant>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/linear/matrix.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::tracking {

/// Largest number of sensors of one source; size of all tables per sensor.
constexpr int kMaxSensors = 4;

/// Converters of the columns, in TDM. Only in double: images have no room for it.
template <typename Scalar>
struct ConverterStep {};
template <>
struct ConverterStep<double> {
    double coupling = 0;  // that changes a sample by one code; 0: unknown
    double noise = 0;     // standard deviation of a sample before its quantisation, codes
};

/// Parameters of all methods.
template <typename Scalar>
struct CommonParams {
    Scalar coupling_constant = 1;                     // C, coupling units times m^3; not used with a calibration
    Vec3<Scalar> hemisphere = Vec3<Scalar>::UnitX();  // direction to the half space at the start; zero: unknown
    bool confined = false;                            // the sensor never leaves that half space (wall, table)
    Scalar floor_share = 1;                           // of misfit_floor, in the covariance of poses
    Microseconds max_column_span{0};                  // see SignalMatrixAssembler; column_span() derives it from a plan
    Scalar window_s = 0;                              // length of a demodulation window, for the predicted blur
    Scalar latency_s = 0;                             // from a pose's time to its use, for the predicted error
    Scalar min_snr = 10;                              // k / sigma below which a pose is flagged (20 dB)
    /// Share of squared couplings that no dipole explains; above it no sensor is assumed. Rank-one crosstalk has 1/3, real
    /// sensors have up to 0.034.
    Scalar max_misfit = Scalar(0.1);
    Scalar distortion_gate = 21;         // chi-square of 3 degrees of freedom, exceeded once in 10,000
    Scalar misfit_floor = Scalar(1e-6);  // misfit of calibrated coils without metal, per coupling, relative to k
    Scalar quadrature_floor = 1;         // quadrature of clean coils per coupling, relative to k; 1: unknown, it is not judged
    Scalar quadrature_lag_s = Scalar(1e-4);  // quadrature that motion causes, over the rate X'; set_plan() computes it
    Scalar max_deviation_m = Scalar(0.02);   // standard deviation of the position (3D) above which a pose is invalid
    Scalar pick_up_sigma = 0;                // standard deviation of the calibrated pick-up, coupling units
    Microseconds lost_after{100'000};        // without a valid pose
    Microseconds search_after{1'000'000};    // without a valid pose; then a matrix tracker forgets the last one
    [[no_unique_address]] ConverterStep<Scalar> converter;

    /// Variance of a coupling due to errors of the calibration, coupling units squared: of the misfit; with the share, of the
    /// directions that a pose explains. strength: k.
    [[nodiscard]] Scalar calibration_variance(Scalar strength, Scalar share = 1) const {
        const Scalar floor = share * misfit_floor * strength;
        return floor * floor + pick_up_sigma * pick_up_sigma;
    }
};

/// DirectTracker: closed-form maximum-likelihood pose of each complete signal matrix.
struct DirectParams {
    bool deskew = false;  // TDM: extrapolate each column to the time of the newest
};

/// PreviousTracker: the previous-measurement technique in its pole-free form. Acquisition uses the direct solver.
struct PreviousParams {
    int passes = 1;       // steps per matrix
    bool deskew = false;  // TDM: extrapolate each column to the time of the newest
};

/// Process noise of the SCAAT filter, estimated within limits; see scaat/process_noise.hpp. The limits come from hand motion:
/// 0.1 m/s^2 for 0.1 s is a resting hand, 2,000 m/s^2 for 25 ms is the paper's example III. Gain, rise and smoothing were chosen
/// on recorded hand motions (tests/bench/tracking_table): errors change by less than 2 % around these values, also on the half of
/// the files that was not used for the choice.
template <typename Scalar>
struct ProcessNoiseParams {
    Scalar least_m2_s3 = Scalar(1e-3);       // translation, m^2/s^3
    Scalar most_m2_s3 = Scalar(1e5);         //
    Scalar start_m2_s3 = 1;                  // at the start: 4.5 m/s^2 for 50 ms
    Scalar least_rad2_s3 = Scalar(0.3);      // rotation, rad^2/s^3
    Scalar most_rad2_s3 = Scalar(1e6);       //
    Scalar start_rad2_s3 = 30;               // 25 rad/s^2 for 50 ms
    Scalar gain = Scalar(1) / 20;            // weight of one column: 20 columns are 28 ms of 240 Hz TDM frames
    Scalar rise = Scalar(1.8);               // factor on the gain for increases: a low q causes lag, a high q only noise
    Scalar smoothing = Scalar(0.35);         // weight of one column's score: at rest single scores are mostly noise
    Scalar information_floor = Scalar(0.2);  // Fisher information per column below which the gain falls: noise hides the motion
    Scalar largest_step = 2;                 // of log q per column: limits the effect of one outlier
};

/// ScaatTracker and, for coils that cannot be corrected to ideal triads, GeneralTracker: a Kalman filter over single columns.
template <typename Scalar>
struct ScaatParams {
    ProcessNoiseParams<Scalar> process;
    Scalar gate = 30;                     // squared innovation over its covariance, 3 degrees of freedom: exceeded once in 7e5
    Scalar most_inflated = Scalar(0.05);  // innovation over coupling up to which the covariance is inflated for a manoeuvre
    Scalar start_speed_m_s = 3;           // standard deviation of the velocity at the start: a fast hand
    Scalar start_rate_rad_s = 20;         // standard deviation of the angular rate at the start
    Scalar consistency_gain = Scalar(1) / 24;  // weight of a column in the windowed consistency: 24 columns are 33 ms of TDM
    Scalar inconsistent_above = 6;             // mean squared innovation per degree of freedom; expectation 1
    Microseconds max_lateness{10'000};         // largest age of a column relative to the newest: two frames at 240 Hz
    Microseconds coast_limit{40'000};          // longest prediction without columns; then a pose is stale
    Microseconds predict_ahead{0};             // predict poses by this time, to compensate the delay of a display; 0: none
};

/// DualBandTracker, only in double: two bands of FDM columns. The window of their comparison holds a whole number of mains cycles
/// (50 and 60 Hz: 0.1 s).
struct DualBandParams {
    static constexpr int kMaxWindowFrames = 64;
    double frame_s = 1.0 / 240;
    int window_frames = 24;
    bool filter = false;            // true: PoseFilter follows
    Microseconds predict_ahead{0};  // of that filter, as in ScaatParams
};
/// Sets the parameters for frames of this length. window_frames is zero, which check() refuses, if no allowed window holds a
/// whole number of mains cycles within 0.4 %; the frequency of the mains may differ by 1 % (EN 50160).
void set_frame(DualBandParams& params, double frame_s);
inline DualBandParams dual_band_params(double frame_s) {
    DualBandParams params;
    set_frame(params, frame_s);
    return params;
}

/// Method of a tracker, with its parameters.
template <typename Scalar>
using MethodParams = std::variant<DirectParams, PreviousParams, ScaatParams<Scalar>, DualBandParams>;

template <typename Scalar>
struct TrackerParams {
    CommonParams<Scalar> common;
    MethodParams<Scalar> method;
};

static_assert(sizeof(TrackerParams<float>) <= 192, "size of the parameters in float");

/// max_column_span for a plan. FDM columns are simultaneous. The first and third of three consecutive TDM columns are two slots
/// apart; with a lost slot they exceed the limit.
Microseconds column_span(const signal::AcquisitionPlan& plan);
/// Sets the parameters that follow from a plan: max_column_span, window_s, quadrature_lag_s.
template <typename Scalar>
void set_plan(CommonParams<Scalar>& common, const signal::AcquisitionPlan& plan);

/// Errors (invalid_argument), with the reason: a number is not finite or out of its limits, or times are out of order.
template <typename Scalar>
Status check(const TrackerParams<Scalar>& params);

}  // namespace tricoil::tracking
