// Acquisition parameters for processors without floating-point unit: integer lengths and cycles.
#pragma once

#include <algorithm>
#include <array>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::fixed {

/// Integers only, so that firmware can define them as constants.
struct Acquisition {
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    int sample_rate_hz = 144'000;
    int block_samples = 200;
    int guard_samples = 40;                                 // dropped at the start of each block
    std::array<int, kSourceCoils> window_cycles{11, 0, 0};  // whole carrier cycles in the window; TDM uses the first

    [[nodiscard]] constexpr bool is_tdm() const { return multiplexing == signal::Multiplexing::tdm; }
    [[nodiscard]] constexpr std::size_t carriers() const { return is_tdm() ? 1 : kSourceCoils; }
    [[nodiscard]] constexpr int window_samples() const { return block_samples - guard_samples; }
    /// Duration of `halves` half samples, to the nearest microsecond.
    [[nodiscard]] constexpr Microseconds half_samples(int halves) const {
        const std::int64_t rate = sample_rate_hz;
        return Microseconds{(std::int64_t{halves} * 1'000'000 + rate) / (2 * rate)};
    }
    /// Time between the first sample of a block and the middle of its window.
    [[nodiscard]] constexpr Microseconds midpoint_offset() const {
        return half_samples(2 * guard_samples + window_samples() - 1);
    }
    /// Longest time span of the columns of one matrix: see tracking::column_span.
    [[nodiscard]] constexpr Microseconds column_span() const {
        return is_tdm() ? half_samples(5 * block_samples) : Microseconds{0};
    }
};

/// Errors (invalid_argument): rate, lengths or cycles out of range.
constexpr Status check(const Acquisition& acquisition) {
    if (acquisition.sample_rate_hz < 1) {
        return {StatusCode::invalid_argument, "sample rate must be positive"};
    }
    if (acquisition.block_samples < 16 || acquisition.block_samples > kMaxBlockSamples || acquisition.guard_samples < 0 ||
        acquisition.guard_samples > acquisition.block_samples - 16) {
        return {StatusCode::invalid_argument, "blocks must hold 16 to 1024 samples, 16 of them after the guard"};
    }
    for (std::size_t j = 0; j < acquisition.carriers(); ++j) {
        if (acquisition.window_cycles[j] < 1 || 2 * acquisition.window_cycles[j] >= acquisition.window_samples()) {
            return {StatusCode::invalid_argument,
                    "carriers must have a whole number of cycles in the window, and be below half the sample rate"};
        }
    }
    return {};
}

/// Converts a plan that was computed in double. Errors (invalid_argument): a sample rate that is not an integer in hertz or not
/// below 2^31, two bands, and those of check().
inline Result<Acquisition> acquisition_of(const signal::AcquisitionPlan& plan) {
    const double rate_hz = plan.params.sample_rate_hz;
    if (!(rate_hz >= 1 && rate_hz < 2147483648.0) || rate_hz != static_cast<double>(static_cast<std::int32_t>(rate_hz))) {
        return Status{StatusCode::invalid_argument, "sample rate must be a whole number of hertz below 2^31"};
    }
    if (plan.has_low_band()) {
        return Status{StatusCode::invalid_argument, "integer trackers use one band"};
    }
    Acquisition acquisition{plan.params.multiplexing, static_cast<std::int32_t>(rate_hz), plan.block_samples,
                            plan.params.guard_samples};
    std::copy_n(plan.window_cycles.begin(), acquisition.window_cycles.size(), acquisition.window_cycles.begin());
    const Status status = check(acquisition);
    return status.ok() ? Result<Acquisition>(acquisition) : status;
}

}  // namespace tricoil::fixed
