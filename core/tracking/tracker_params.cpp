#include "core/tracking/tracker_params.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/precision.hpp"
#include "core/calibration/calibration.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::tracking {
namespace {

Status refused(const char* reason) { return {StatusCode::invalid_argument, reason}; }

template <typename Scalar>
bool is_positive(Scalar value) {
    return std::isfinite(value) && value > 0;
}

bool is_permitted(const ConverterStep<float>&) { return true; }
[[maybe_unused]] bool is_permitted(const ConverterStep<double>& converter) {
    return converter.coupling >= 0 && converter.noise >= 0 && std::isfinite(converter.coupling + converter.noise);
}

template <typename Scalar>
Status check_common(const CommonParams<Scalar>& p) {
    if (!is_positive(p.coupling_constant)) {
        return refused("coupling constant must be positive and finite");
    }
    if (!is_positive(p.min_snr) || !is_positive(p.max_misfit) || !is_positive(p.distortion_gate)) {
        return refused("signal limits must be positive and finite");
    }
    if (!(p.misfit_floor >= 0 && p.misfit_floor < 1) || !is_positive(p.max_deviation_m)) {
        return refused("misfit floor must lie between 0 and 1, the largest deviation must be positive and finite");
    }
    if (!(p.quadrature_floor >= 0 && p.quadrature_floor <= 1) || !(p.quadrature_lag_s >= 0 && p.quadrature_lag_s < 1)) {
        return refused("quadrature floor must lie between 0 and 1, its lag between 0 and 1 s");
    }
    if (!(p.pick_up_sigma >= 0) || !std::isfinite(p.pick_up_sigma) ||
        !(p.floor_share > 0 && p.floor_share <= calibration::CoilErrors<Scalar>::kMostOfFloor)) {
        return refused(
            "the deviation of the pick-up must be finite and not negative, the share of the floor above 0, at most 10");
    }
    if (!is_permitted(p.converter)) {
        return refused("step and noise of the converters must be finite and not negative");
    }
    if (p.max_column_span.count() < 0 || p.lost_after.count() <= 0 || p.search_after < p.lost_after) {
        return refused("times must be positive, and search_after not shorter than lost_after");
    }
    if (!std::isfinite(p.window_s) || p.window_s < 0 || !std::isfinite(p.latency_s) || p.latency_s < 0) {
        return refused("window and latency must be finite and not negative");
    }
    if (!is_hemisphere(p.hemisphere)) {
        return refused("hemisphere must be a finite direction, or zero for unknown");
    }
    return {};
}

template <typename Scalar>
Status check_method(const CommonParams<Scalar>&, const DirectParams&) {
    return {};
}

template <typename Scalar>
Status check_method(const CommonParams<Scalar>&, const PreviousParams& p) {
    constexpr int kMaxPasses = 10;
    return p.passes < 1 || p.passes > kMaxPasses ? refused("passes must be 1 to 10") : Status{};
}

template <typename Scalar>
Status check_process_noise(const ProcessNoiseParams<Scalar>& n) {
    for (const Scalar value : {n.least_m2_s3, n.most_m2_s3, n.start_m2_s3, n.least_rad2_s3, n.most_rad2_s3, n.start_rad2_s3,
                               n.rise, n.smoothing, n.information_floor, n.largest_step}) {
        if (!is_positive(value)) {
            return refused("filter parameters must be positive and finite");
        }
    }
    if (n.least_m2_s3 > n.start_m2_s3 || n.start_m2_s3 > n.most_m2_s3 || n.least_rad2_s3 > n.start_rad2_s3 ||
        n.start_rad2_s3 > n.most_rad2_s3) {
        return refused("process noise must be least <= start <= most");
    }
    constexpr Scalar kMax = Scalar(1e12);  // squares of it fit into a float
    if (n.most_m2_s3 > kMax || n.most_rad2_s3 > kMax) {
        return refused("process noise must not exceed 1e12");
    }
    if (!(n.gain > 0 && n.gain < 1)) {
        return refused("weights of a column must lie between 0 and 1");
    }
    if (n.smoothing > 1 || n.rise < 1 || n.rise > 10 || n.largest_step > 10) {
        return refused("process noise: smoothing must be at most 1, rise 1 to 10, largest_step at most 10");
    }
    return {};
}

/// Checks the parameters in floating point; check_filter_times() checks those in microseconds.
template <typename Scalar>
Status check_filter(const CommonParams<Scalar>& common, const ScaatParams<Scalar>& p) {
    for (const Scalar value : {p.gate, p.most_inflated, p.start_speed_m_s, p.start_rate_rad_s, p.inconsistent_above}) {
        if (!is_positive(value)) {
            return refused("filter parameters must be positive and finite");
        }
    }
    if (p.start_speed_m_s > Scalar(1e4) || p.start_rate_rad_s > Scalar(1e4)) {
        return refused("start speed and rate must not exceed 1e4");
    }
    if (!(p.consistency_gain > 0 && p.consistency_gain < 1)) {
        return refused("weights of a column must lie between 0 and 1");
    }
    if (p.gate < 3 || common.distortion_gate < 3) {  // expectation of chi-square
        return refused("gates of 3 degrees of freedom must be at least 3");
    }
    if (p.inconsistent_above < 1) {  // its expected value without errors
        return refused("inconsistent_above must be at least 1");
    }
    if (common.window_s > 1 || common.latency_s > 10) {
        return refused("window must lie between 0 and 1 s, latency between 0 and 10 s");
    }
    return {};
}

template <typename Scalar>
Status check_filter_times(const CommonParams<Scalar>& common, const ScaatParams<Scalar>& p) {
    constexpr Microseconds kLongest{10'000'000};
    for (const Microseconds time : {common.max_column_span, p.max_lateness, p.predict_ahead}) {
        if (time.count() < 0 || time > kLongest) {
            return refused("column span, lateness and prediction must lie between 0 and 10 s");
        }
    }
    constexpr Microseconds kShortest{1'000};
    if (p.coast_limit < kShortest || common.lost_after < p.coast_limit || common.search_after < common.lost_after ||
        common.search_after > kLongest) {
        return refused("times must be 1 ms <= coast_limit <= lost_after <= search_after <= 10 s");
    }
    if (5 * p.coast_limit < 6 * common.max_column_span) {  // column_span() is 2.5 slots, a frame is 3 slots
        return refused("coast_limit must be at least one frame: 1.2 times max_column_span");
    }
    return {};
}

template <typename Scalar>
Status check_method(const CommonParams<Scalar>& common, const ScaatParams<Scalar>& p) {
    Status status = check_process_noise(p.process);
    status = status.ok() ? check_filter(common, p) : status;
    return status.ok() ? check_filter_times(common, p) : status;
}

template <typename Scalar>
Status check_method(const CommonParams<Scalar>& common, const DualBandParams& p) {
    if (common.max_column_span.count() != 0) {
        return refused("two bands need simultaneous columns: max_column_span must be zero");
    }
    if (!is_positive(p.frame_s) || p.window_frames < 2 || p.window_frames > DualBandParams::kMaxWindowFrames) {
        return refused(
            "two bands are compared over 2 to 64 frames in a multiple of 0.1 s: use another frame rate, for example 240 Hz");
    }
    ScaatParams<Scalar> filter;
    filter.predict_ahead = p.predict_ahead;
    return p.filter ? check_method(common, filter) : Status{};
}

/// Motion at the rate X' induces X'/w at a carrier w and leaks, in a window, X'/2w into the same carrier and X'/d into a carrier
/// at the distance d.
[[maybe_unused]] double quadrature_lag_s(const signal::AcquisitionPlan& plan) {
    const auto square_s2 = [](double hz) { return std::pow(2 * std::numbers::pi * hz, -2); };
    constexpr double kOwn = 1.5;  // induced X'/w, and leakage X'/2w from the component at 2w
    const auto& carrier_hz = plan.params.carrier_hz;
    const auto carriers = static_cast<std::size_t>(plan.carriers());
    double most_s2 = 0;
    for (std::size_t j = 0; j < std::min<std::size_t>(carriers, kSourceCoils); ++j) {
        double sum_s2 = kOwn * kOwn * square_s2(carrier_hz[j]);
        for (std::size_t other = 0; other < carriers; ++other) {
            sum_s2 += other == j ? 0 : square_s2(carrier_hz[j] - carrier_hz[other]);
        }
        most_s2 = std::max(most_s2, sum_s2);
    }
    return std::sqrt(most_s2);
}

}  // namespace

Microseconds column_span(const signal::AcquisitionPlan& plan) {
    return plan.is_tdm() ? microseconds_from_seconds(2.5 * plan.block_s()) : Microseconds{0};
}

template <typename Scalar>
void set_plan(CommonParams<Scalar>& common, const signal::AcquisitionPlan& plan) {
    common.max_column_span = column_span(plan);
    common.window_s = static_cast<Scalar>(plan.window_s());
    common.quadrature_lag_s = static_cast<Scalar>(quadrature_lag_s(plan));
}

void set_frame(DualBandParams& params, double frame_s) {
    constexpr double kWindow_s = 0.1;
    constexpr double kTolerance = 4e-3;
    params.frame_s = frame_s;
    params.window_frames = 0;
    for (int n = 1; n * kWindow_s <= DualBandParams::kMaxWindowFrames * params.frame_s && params.window_frames == 0; ++n) {
        const double frames = n * kWindow_s / params.frame_s;
        params.window_frames =
            std::abs(frames - std::round(frames)) < kTolerance * frames ? static_cast<int>(std::lround(frames)) : 0;
    }
}

template <typename Scalar>
Status check(const TrackerParams<Scalar>& params) {
    const Status status = check_common(params.common);
    if (!status.ok()) {
        return status;
    }
    return std::visit([&](const auto& method) { return check_method(params.common, method); }, params.method);
}

template void set_plan(CommonParams<float>&, const signal::AcquisitionPlan&);
template Status check(const TrackerParams<float>&);
#if TRICOIL_SCALARS & 2  // double
template void set_plan(CommonParams<double>&, const signal::AcquisitionPlan&);
template Status check(const TrackerParams<double>&);
#endif

}  // namespace tricoil::tracking
