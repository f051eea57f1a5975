#include "board/host/run/fixed_run.hpp"

#include "board/support/errors.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/fixed/from_double.hpp"

namespace tricoil::host {
namespace {

void refuse(bool asked, const RunOptions& options, const char* what) {
    refuse_if(asked, "{}: not with --tracker {}", what, options.tracker);
}

template <typename T>
T value_of(const Result<T>& result) {
    if (!result.ok()) {
        throw InputError(std::string("integer tracker: ") + result.status().message());
    }
    return *result;
}

template <typename T>
void put(OutputFile& file, const T* from, std::size_t count) {
    file.write({reinterpret_cast<const char*>(from), count * sizeof(T)});  // NOLINT: bytes as such
}

}  // namespace

app::FixedChain::Params fixed_params(const RunOptions& options, const RunObservers& observers, const sim::CoilWorld& world,
                                     const signal::AcquisitionPlan& plan, const Vec3<double>& hemisphere) {
    refuse(observers.tap != nullptr, options, "serve");
    refuse(!options.record.empty(), options, "--record (use --samples)");
    prediction_of_option(options.tracker, options.predict_ahead_s);
    refuse(options.no_deskew, options, "--no-deskew");
    app::FixedChain::Params params;
    params.plan = plan;
    params.chain.acquisition = value_of(fixed::acquisition_of(plan));
    params.chain.demodulator = value_of(fixed::demodulator_params_from(world.demodulation(), world.volts_per_code()));
    fixed::TrackerParams& tracker = params.chain.tracker;
    tracker.method = *fixed_method(options.tracker);
    tracker.passes = options.passes;
    tracker.coupling_constant = fixed::scaled_from(world.params().coupling_constant_m3);
    tracker.hemisphere = fixed::direction_from(hemisphere);
    tracker.confined = options.confined || !options.hemisphere.empty();
    if (const Status status = fixed::check(params.chain); !status.ok()) {
        throw InputError(std::string("integer tracker: ") + status.message());
    }
    return params;
}

tracking::TrackerCounters in_common_counters(const fixed::TrackerCounters& counters) {
    tracking::TrackerCounters common;
    common.accepted = counters.accepted;
    common.poses = counters.poses;
    common.invalid_poses = counters.invalid_poses;
    common.acquisitions = counters.acquisitions;
    common.clock_restarts = counters.restarts;
    const auto copy = [&](tracking::Rejection to, fixed::Rejection from) {
        common.rejected[static_cast<std::size_t>(to)] = counters.of(from);
    };
    copy(tracking::Rejection::unknown_state, fixed::Rejection::unknown_state);
    copy(tracking::Rejection::time_backwards, fixed::Rejection::time_backwards);
    copy(tracking::Rejection::duplicate, fixed::Rejection::repeated_sequence);
    return common;
}

Status FixedLink::do_send(const fixed::PoseEstimate& estimate) {
    if (each_) {
        each_(estimate);
    }
    return link_.send(fixed::to_double(estimate));
}

SampleRecorder::SampleRecorder(const std::string& path, const fixed::ChainParams& params, hal::CoilSampler& sampler,
                               const hal::Clock& clock)
    : file_(path), sampler_(sampler), clock_(clock) {
    const fixed::RecordHead head = fixed::head_of(params);
    put(file_, &head, 1);
}

Status SampleRecorder::do_poll(SampleBlock& block) {
    const Status status = sampler_.poll(block);
    if (!status.ok() && status.code() != StatusCode::timed_out) {
        return status;
    }
    fixed::RecordBlock record;
    record.now_us = to_us(clock_.now());
    if (status.ok()) {
        record.start_us = to_us(block.start);
        record.sequence = block.sequence;
        record.state = static_cast<std::int32_t>(block.state);
        record.full_scale = block.full_scale;
        record.arrived = 1;
    }
    put(file_, &record, 1);
    if (status.ok()) {
        put(file_, block.samples.data(), block.samples.size());
    }
    return status;
}

}  // namespace tricoil::host
