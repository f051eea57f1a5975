#include "board/host/run/sample_recorder.hpp"

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

template <typename T>
void put(std::ofstream& file, const T* from, std::size_t count) {
    file.write(reinterpret_cast<const char*>(from), static_cast<std::streamsize>(count * sizeof(T)));
}

}  // namespace

SampleRecorder::SampleRecorder(const std::string& path, const fixed::ChainParams& params, hal::CoilSampler& sampler,
                               const hal::Clock& clock)
    : path_(path), file_(path, std::ios::binary), sampler_(sampler), clock_(clock) {
    const fixed::RecordHead head = fixed::head_of(params);
    put(file_, &head, 1);
    if (!file_) {
        throw InputError("--samples " + path + ": cannot be written");
    }
}

void SampleRecorder::close() {
    file_.close();
    if (!file_) {
        throw DeviceError("--samples " + path_ + ": not all samples could be written");
    }
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
