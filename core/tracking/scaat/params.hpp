// What can be set about the filter.
#pragma once

#include <cmath>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/tracking/scaat/process_noise.hpp"

namespace tricoil::tracking::scaat {

template <typename Scalar>
struct Params {
    Vec3<Scalar> hemisphere = Vec3<Scalar>::UnitX();  // towards the half space the sensor starts in; zero: unknown
    bool confined = false;                            // to that half space, by a wall or a table: told again after every loss
    Microseconds max_column_span{0};                  // of three columns that start the filter; zero: simultaneous (FDM)
    Scalar window_s = 0;                              // length of a demodulation window, for the predicted blur
    Scalar latency_s = 0;                             // from a pose's time to its use, for the predicted error
    ProcessNoiseParams<Scalar> process;
    Scalar gate = 30;                   // squared innovation over its covariance, 3 degrees of freedom: passed once in 7e5
    Scalar most_opened = Scalar(0.05);  // innovation over coupling up to which a manoeuvre is followed rather than searched
    Scalar start_speed_m_s = 3;         // standard deviation of the velocity when the filter starts: a fast hand
    Scalar start_rate_rad_s = 20;       // likewise of the angular rate
    Scalar consistency_gain = Scalar(1) / 24;  // weight of a column in the windowed consistency: 24 columns are 33 ms of TDM
    Scalar inconsistent_above = 6;             // mean squared innovation per degree of freedom; expectation 1
    Scalar min_snr = 10;                       // k / sigma below which a pose is flagged (20 dB), as for the other trackers
    Scalar max_misfit = Scalar(0.1);           // share of the couplings' power that no pose explains: no sensor
    Scalar distortion_gate = Scalar(16.27);    // chi-square of 3 degrees of freedom passed once in 1,000
    Microseconds max_lateness{10'000};         // a column older than the newest by more is refused: two frames at 240 Hz
    Microseconds coast_limit{40'000};          // prediction without columns beyond which a pose is stale
    Microseconds lost_after{100'000};          // without a valid pose
    Microseconds search_after{1'000'000};      // when lost: give the last pose up
    Microseconds predict_ahead{0};             // deliver the pose this long after the newest column, to hide a display's delay
};

static_assert(sizeof(Params<float>) <= 152, "set once, kept by every filter");

/// Errors (invalid_argument): a number not positive or not finite, or with which no filter works; limits out of order, times
/// negative or beyond 10 s.
template <typename Scalar>
Status check(const Params<Scalar>& p) {
    const auto& n = p.process;
    for (const Scalar value : {n.least_m2_s3, n.most_m2_s3, n.start_m2_s3, n.least_rad2_s3, n.most_rad2_s3, n.start_rad2_s3,
                               n.rise, n.smoothing, n.information_floor, n.largest_step, p.gate, p.most_opened, p.start_speed_m_s,
                               p.start_rate_rad_s, p.inconsistent_above, p.min_snr, p.max_misfit, p.distortion_gate}) {
        if (!std::isfinite(value) || !(value > 0)) {
            return {StatusCode::invalid_argument, "filter parameters must be positive and finite"};
        }
    }
    if (n.least_m2_s3 > n.start_m2_s3 || n.start_m2_s3 > n.most_m2_s3 || n.least_rad2_s3 > n.start_rad2_s3 ||
        n.start_rad2_s3 > n.most_rad2_s3) {
        return {StatusCode::invalid_argument, "process noise must be least <= start <= most"};
    }
    constexpr Scalar kMost = Scalar(1e12);  // squares of it fit into a float
    if (n.most_m2_s3 > kMost || n.most_rad2_s3 > kMost || p.start_speed_m_s > Scalar(1e4) || p.start_rate_rad_s > Scalar(1e4)) {
        return {StatusCode::invalid_argument, "process noise beyond 1e12, or a start speed or rate beyond 1e4, is no sensor's"};
    }
    if (!(n.gain > 0 && n.gain < 1) || !(p.consistency_gain > 0 && p.consistency_gain < 1)) {
        return {StatusCode::invalid_argument, "weights of a column must lie between 0 and 1"};
    }
    if (n.smoothing > 1 || n.rise < 1 || n.rise > 10 || n.largest_step > 10) {
        return {StatusCode::invalid_argument, "process noise: smoothing at most 1, rise 1 to 10, largest step at most 10"};
    }
    if (p.gate < 3 || p.distortion_gate < 3) {  // their expectation
        return {StatusCode::invalid_argument, "gates of 3 degrees of freedom must be at least 3"};
    }
    if (!(p.window_s >= 0 && p.window_s <= 1) || !(p.latency_s >= 0 && p.latency_s <= 10)) {
        return {StatusCode::invalid_argument, "window must lie between 0 and 1 s, latency between 0 and 10 s"};
    }
    if (p.inconsistent_above < 1) {  // its expectation
        return {StatusCode::invalid_argument, "inconsistent_above must be at least 1"};
    }
    constexpr Microseconds kLongest{10'000'000};
    for (const Microseconds time : {p.max_column_span, p.max_lateness, p.predict_ahead}) {
        if (time.count() < 0 || time > kLongest) {
            return {StatusCode::invalid_argument, "column span, lateness and prediction must lie between 0 and 10 s"};
        }
    }
    constexpr Microseconds kShortest{1'000};
    if (p.coast_limit < kShortest || p.lost_after < p.coast_limit || p.search_after < p.lost_after || p.search_after > kLongest) {
        return {StatusCode::invalid_argument, "times must be 1 ms <= coast_limit <= lost_after <= search_after <= 10 s"};
    }
    if (5 * p.coast_limit < 6 * p.max_column_span) {  // see column_span(): a frame is three slots, that is two and a half
        return {StatusCode::invalid_argument, "coast_limit must be at least a frame: 1.2 times max_column_span"};
    }
    if (!p.hemisphere.allFinite()) {
        return {StatusCode::invalid_argument, "hemisphere must be a finite direction, or zero for unknown"};
    }
    return {};
}

}  // namespace tricoil::tracking::scaat
