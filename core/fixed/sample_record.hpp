// Input of an integer tracker as words of fixed size: first the parameters, then each poll of the converters. A tracker computes
// the same poses from a record on any processor. Little-endian.
#pragma once

#include "core/fixed/tracker.hpp"

namespace tricoil::fixed {

/// All parameters of the tracker.
struct ChainParams {
    Acquisition acquisition;
    DemodulatorParams demodulator;
    TrackerParams tracker;
};

/// Errors: those of check() of the three members.
inline Status check(const ChainParams& params) {
    for (const Status& status : {check(params.acquisition), check(params.demodulator), check(params.tracker)}) {
        if (!status.ok()) {
            return status;
        }
    }
    return {};
}

constexpr std::uint32_t kSampleRecordMagic = 0x53435254;  // "TRCS"
constexpr std::uint32_t kSampleRecordVersion = 1;

/// Start of a record. Parameters that are not listed here have their default values.
struct RecordHead {
    std::uint32_t magic = kSampleRecordMagic;
    std::uint32_t version = kSampleRecordVersion;
    std::int32_t multiplexing = 0;
    std::int32_t sample_rate_hz = 0;
    std::int32_t block_samples = 0;
    std::int32_t guard_samples = 0;
    std::int32_t window_cycles[kSourceCoils] = {};
    std::int32_t corrections[kSourceCoils][kSensorCoils][3] = {};  // real and imaginary mantissa, exponent
    std::int32_t least_reference = 0;
    std::int32_t low_signal_ratio = 0;
    std::int32_t linear_share = 0;
    std::int32_t noise_shift = 0;
    std::int32_t noise_jump = 0;
    std::int32_t method = 0;
    std::int32_t passes = 0;
    std::int32_t confined = 0;
    std::int32_t hemisphere[3] = {};
    std::int32_t coupling_mantissa = 0;
    std::int32_t coupling_exponent = 0;
};
static_assert(sizeof(RecordHead) == 4 * 49);

/// One poll; block_samples samples follow if a block arrived.
struct RecordBlock {
    std::int64_t start_us = 0;
    std::int64_t now_us = 0;  // after the poll
    std::uint32_t sequence = 0;
    std::int32_t state = 0;  // excitation state
    std::int32_t full_scale = 0;
    std::int32_t arrived = 0;  // 0: timed out
};
static_assert(sizeof(RecordBlock) == 32);

RecordHead head_of(const ChainParams& params);

/// Errors: invalid_argument for another magic or version, an unknown multiplexing or method, and those of check().
Result<ChainParams> params_of(const RecordHead& head);

}  // namespace tricoil::fixed
