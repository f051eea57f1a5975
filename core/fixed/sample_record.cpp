#include "core/fixed/sample_record.hpp"

namespace tricoil::fixed {

RecordHead head_of(const ChainParams& params) {
    RecordHead head;
    const Acquisition& a = params.acquisition;
    head.multiplexing = static_cast<std::int32_t>(a.multiplexing);
    head.sample_rate_hz = a.sample_rate_hz;
    head.block_samples = a.block_samples;
    head.guard_samples = a.guard_samples;
    const DemodulatorParams& d = params.demodulator;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        head.window_cycles[j] = a.window_cycles[j];
        for (std::size_t i = 0; i < kSensorCoils; ++i) {
            const Correction& c = d.corrections[j][i];
            head.corrections[j][i][0] = c.re.raw();
            head.corrections[j][i][1] = c.im.raw();
            head.corrections[j][i][2] = c.exponent;
        }
    }
    head.least_reference = d.least_reference;
    head.low_signal_ratio = d.low_signal_ratio;
    head.linear_share = d.linear_share.raw();
    head.noise_shift = d.noise_shift;
    head.noise_jump = d.noise_jump;
    const TrackerParams& t = params.tracker;
    head.method = static_cast<std::int32_t>(t.method);
    head.passes = t.passes;
    head.confined = t.confined ? 1 : 0;
    for (Index i = 0; i < 3; ++i) {
        head.hemisphere[i] = t.hemisphere(i).raw();
    }
    head.coupling_mantissa = t.coupling_constant.mantissa;
    head.coupling_exponent = t.coupling_constant.exponent;
    return head;
}

Result<ChainParams> params_of(const RecordHead& head) {
    if (head.magic != kSampleRecordMagic || head.version != kSampleRecordVersion) {
        return Status{StatusCode::invalid_argument, "not a sample record of this version"};
    }
    if (head.multiplexing < 0 || head.multiplexing > 1 || head.method < 0 || head.method > 1) {
        return Status{StatusCode::invalid_argument, "unknown multiplexing or method"};
    }
    ChainParams params;
    Acquisition& a = params.acquisition;
    a.multiplexing = static_cast<signal::Multiplexing>(head.multiplexing);
    a.sample_rate_hz = head.sample_rate_hz;
    a.block_samples = head.block_samples;
    a.guard_samples = head.guard_samples;
    DemodulatorParams& d = params.demodulator;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        a.window_cycles[j] = head.window_cycles[j];
        for (std::size_t i = 0; i < kSensorCoils; ++i) {
            const auto& c = head.corrections[j][i];
            d.corrections[j][i] = {Unit::from_raw(c[0]), Unit::from_raw(c[1]), c[2]};
        }
    }
    d.least_reference = head.least_reference;
    d.low_signal_ratio = head.low_signal_ratio;
    d.linear_share = Unit::from_raw(head.linear_share);
    d.noise_shift = head.noise_shift;
    d.noise_jump = head.noise_jump;
    TrackerParams& t = params.tracker;
    t.method = static_cast<Method>(head.method);
    t.passes = head.passes;
    t.confined = head.confined != 0;
    for (Index i = 0; i < 3; ++i) {
        t.hemisphere(i) = Unit::from_raw(head.hemisphere[i]);
    }
    t.coupling_constant = {head.coupling_mantissa, head.coupling_exponent};
    const Status status = check(params);
    return status.ok() ? Result<ChainParams>(params) : status;
}

}  // namespace tricoil::fixed
