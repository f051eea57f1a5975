#include "core/signal/acquisition_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace tricoil::signal {
namespace {

constexpr double kWholeTolerance = 1e-6;  // relative: decimal frequencies are rarely exact in binary
constexpr double kHighestCarrierShare = 0.45;
constexpr int kMinCycles = 4;
constexpr int kMinCyclesApart = 2;
constexpr double kTdmCarrierHz = 10e3;
constexpr std::array<double, kSourceCoils> kFdmCarriersHz{7.7e3, 10e3, 13.4e3};
constexpr std::array<double, kSourceCoils> kLowCarriersHz{480, 720, 960};
constexpr int kMinLowCycles = 2;
constexpr int kGuardDivisor = 5;
/// A carrier is shifted by at most this fraction, to give it the same phase in all blocks.
constexpr double kFarthestShare = 0.2;

constexpr Status invalid(const char* message) { return {StatusCode::invalid_argument, message}; }

bool is_positive(double value) { return std::isfinite(value) && value > 0; }

bool is_whole(double value) { return std::abs(value - std::round(value)) <= kWholeTolerance * std::max(1.0, std::abs(value)); }

double samples_per_block(const AcquisitionParams& params) {
    const double blocks_per_frame = params.multiplexing == Multiplexing::tdm ? kSourceCoils : 1;
    return params.sample_rate_hz / (params.frame_rate_hz * blocks_per_frame);
}

Status check_rates(const AcquisitionParams& params) {
    if (!is_positive(params.sample_rate_hz)) {
        return invalid("sample rate must be a positive number of hertz");
    }
    if (!is_positive(params.frame_rate_hz)) {
        return invalid("frame rate must be a positive number of hertz");
    }
    const double samples = samples_per_block(params);
    if (samples > kMaxBlockSamples) {
        return invalid("frame rate is too low: a block would exceed 1024 samples");
    }
    if (samples < 1 || !is_whole(samples)) {
        return invalid(
            "a block is not a whole number of samples: choose a frame rate that divides the sample rate "
            "(TDM: three slots per frame)");
    }
    return {};
}

Status check_carrier(double carrier_hz, double cycles, double sample_rate_hz, bool is_low) {
    if (!is_positive(carrier_hz)) {
        return invalid("carrier frequency must be a positive number of hertz");
    }
    if (carrier_hz > kHighestCarrierShare * sample_rate_hz) {
        return invalid("carrier lies above 0.45 of the sample rate (Nyquist): lower it or sample faster");
    }
    if (!is_whole(cycles)) {
        return invalid("carrier does not fill the window with whole cycles: use a multiple of sample rate / window samples");
    }
    if (is_low && cycles < kMinLowCycles - 0.5) {
        return invalid("fewer than two cycles of a low carrier per window: lower the frame rate or use one band");
    }
    if (!is_low && cycles < kMinCycles - 0.5) {
        return invalid("fewer than four carrier cycles per window: lower the frame rate or use FDM");
    }
    return {};
}

/// Distance of carrier j to the carriers before it.
Status check_distances(const AcquisitionPlan& plan, std::size_t j) {
    const bool is_low = j >= kSourceCoils;
    for (std::size_t other = 0; other < j; ++other) {
        const int apart = plan.window_cycles[other] - plan.window_cycles[j];
        if (is_low && other < kSourceCoils && apart < kMinCyclesApart) {
            return invalid("low carriers must be at least two cycles per window below all high carriers");
        }
        if (is_low && apart == 0) {
            return invalid("low carriers have equal cycles per window: spread them, or lower the frame rate");
        }
        if (!is_low && std::abs(apart) < kMinCyclesApart) {
            return invalid("FDM carriers are closer than two cycles per window: spread them");
        }
    }
    return {};
}

double snap_to_cycles(double nominal_hz, double window_s) { return std::max(1.0, std::round(nominal_hz * window_s)) / window_s; }

/// Whole cycles in the window. If a small change suffices, also in the block, so that the carrier has the same phase in every
/// block.
double choose_carrier(double nominal_hz, int block, int guard, double sample_rate_hz) {
    const double in_both = snap_to_cycles(nominal_hz, std::gcd(block, block - guard) / sample_rate_hz);
    if (std::abs(in_both - nominal_hz) < kFarthestShare * nominal_hz) {
        return in_both;
    }
    return snap_to_cycles(nominal_hz, (block - guard) / sample_rate_hz);
}

}  // namespace

AcquisitionParams default_acquisition(Multiplexing multiplexing, double frame_rate_hz, double sample_rate_hz) {
    AcquisitionParams params{multiplexing, sample_rate_hz, frame_rate_hz, {}, 0};
    if (!check_rates(params).ok()) {
        return params;  // plan_acquisition() gives the reason
    }
    const int block = static_cast<int>(std::lround(samples_per_block(params)));
    const bool is_tdm = multiplexing == Multiplexing::tdm;
    params.guard_samples = is_tdm ? block / kGuardDivisor : 0;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        params.carrier_hz[j] =
            choose_carrier(is_tdm ? kTdmCarrierHz : kFdmCarriersHz[j], block, params.guard_samples, sample_rate_hz);
    }
    const std::size_t carriers = multiplexing == Multiplexing::dual_band ? kMaxCarriers : kSourceCoils;
    for (std::size_t j = kSourceCoils; j < carriers; ++j) {
        params.carrier_hz[j] = snap_to_cycles(kLowCarriersHz[j - kSourceCoils], 1 / frame_rate_hz);
    }
    return params;
}

Result<AcquisitionPlan> plan_acquisition(const AcquisitionParams& params) {
    if (const Status rates = check_rates(params); !rates.ok()) {
        return rates;
    }
    AcquisitionPlan plan{params, static_cast<int>(std::lround(samples_per_block(params))), 0, {}};
    if (params.guard_samples < 0 || params.guard_samples >= plan.block_samples) {
        return invalid("guard must be at least zero and shorter than the block");
    }
    plan.window_samples = plan.block_samples - params.guard_samples;
    const bool is_low_stated = std::any_of(params.carrier_hz.begin() + kSourceCoils, params.carrier_hz.end(),
                                           [](double carrier_hz) { return carrier_hz != 0; });
    if (is_low_stated && !plan.has_low_band()) {
        return invalid("low carriers need two bands: choose dual-band multiplexing");
    }
    const std::size_t carriers = plan.has_low_band() ? kMaxCarriers : kSourceCoils;
    for (std::size_t j = 0; j < carriers; ++j) {
        const double carrier = plan.is_tdm() ? params.carrier_hz[0] : params.carrier_hz[j];
        const double cycles = carrier * plan.window_s();
        if (const Status status = check_carrier(carrier, cycles, params.sample_rate_hz, j >= kSourceCoils); !status.ok()) {
            return status;
        }
        plan.params.carrier_hz[j] = carrier;
        plan.window_cycles[j] = static_cast<int>(std::lround(cycles));
        if (const Status status = plan.is_tdm() ? Status{} : check_distances(plan, j); !status.ok()) {
            return status;
        }
    }
    return plan;
}

}  // namespace tricoil::signal
