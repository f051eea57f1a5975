#include "board/app/supervised_sampler.hpp"

#include <algorithm>
#include <cstdlib>

namespace tricoil::app {
namespace {

constexpr const char* kTooMuchCurrent = "over-current: a power stage is faulty";

/// Largest code magnitude of the sensor channels, and half of the peak-to-peak value of the reference channel.
struct Peaks {
    std::int32_t sensor = 0;
    std::int32_t reference = 0;
};

Peaks peaks_of(std::span<const Sample> window) {
    Peaks peaks;
    std::int32_t lowest = window.front()[kReferenceChannel];
    std::int32_t highest = lowest;
    for (const Sample& sample : window) {
        peaks.sensor = std::max({peaks.sensor, std::abs(sample[0]), std::abs(sample[1]), std::abs(sample[2])});
        lowest = std::min(lowest, sample[kReferenceChannel]);
        highest = std::max(highest, sample[kReferenceChannel]);
    }
    peaks.reference = (highest - lowest) / 2;
    return peaks;
}

}  // namespace

Status SupervisedSampler::do_start(const signal::AcquisitionPlan& plan) {
    fault_.reset();
    guard_ = static_cast<std::size_t>(plan.params.guard_samples);
    if (const Status chosen = gain_.choose(ranging_.step()); !chosen.ok()) {
        return chosen;
    }
    return sampler_.start(plan);
}

Status SupervisedSampler::do_poll(SampleBlock& block) {
    if (!heartbeat_.beat().ok()) {
        return fail(protocol::Fault::drive, "the heartbeat line is lost");
    }
    const Status polled = sampler_.poll(block);
    if (polled.code() == StatusCode::over_current) {  // first, because no current flows in the rest of this block
        return fail(protocol::Fault::overcurrent, kTooMuchCurrent);
    }
    if (!polled.ok()) {
        return fail(protocol::Fault::converter, "no data from the converters");
    }
    if (block.overrun_count > 0 || block.samples.size() <= guard_) {
        overruns_ += block.overrun_count;
        return fail(protocol::Fault::converter, "the converters lost samples");
    }
    const Peaks peaks = peaks_of(block.samples.subspan(guard_));
    if (static_cast<float>(peaks.reference) * block.scale > most_reference_v_) {
        return fail(protocol::Fault::overcurrent, kTooMuchCurrent);
    }
    if (block.full_scale > 0) {
        const float share = static_cast<float>(peaks.sensor) / static_cast<float>(block.full_scale);
        (void)gain_.choose(ranging_.next(share, block.gain_step));  // cannot fail: the step exists
    }
    return {};
}

Status SupervisedSampler::fail(protocol::Fault fault, const char* reason) {
    fault_ = fault;
    return {StatusCode::device_lost, reason};
}

}  // namespace tricoil::app
