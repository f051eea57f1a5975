#include "board/qemu_an386/recorded_coils.hpp"

namespace tricoil::board {

Result<fixed::ChainParams> RecordedCoilSampler::read_head() {
    fixed::RecordHead head;
    if (!file_.read(&head, sizeof head)) {
        return Status{StatusCode::end_of_stream, "no sample record"};
    }
    return fixed::params_of(head);
}

Status RecordedCoilSampler::do_start(const signal::AcquisitionPlan& plan) {
    if (static_cast<std::size_t>(plan.block_samples) > samples_.size()) {
        return {StatusCode::invalid_argument, "recorded blocks must not exceed 256 samples"};
    }
    block_samples_ = static_cast<std::size_t>(plan.block_samples);
    return {};
}

Status RecordedCoilSampler::do_poll(SampleBlock& block) {
    fixed::RecordBlock record;
    if (!file_.read(&record, sizeof record)) {
        return {StatusCode::end_of_stream, "end of the record"};
    }
    clock_.set(device_time_us(record.now_us));
    if (record.arrived == 0) {
        return {StatusCode::timed_out, "the block was lost"};
    }
    const auto samples = std::span<Sample>(samples_).first(block_samples_);
    if (!file_.read(samples.data(), static_cast<std::uint32_t>(samples.size_bytes()))) {
        return {StatusCode::device_lost, "the record ends within a block"};
    }
    block = {};
    block.state = static_cast<Excitation>(record.state);
    if (block.state != coils_.state()) {
        return {StatusCode::device_lost, "the record has another excitation state"};
    }
    block.full_scale = record.full_scale;
    block.start = device_time_us(record.start_us);
    block.sequence = record.sequence;
    block.samples = samples;
    return {};
}

}  // namespace tricoil::board
