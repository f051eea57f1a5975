#include "sim/front_end/services.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/calibration/blob.hpp"
#include "core/selfcheck/selfcheck.hpp"

namespace tricoil::sim {
namespace {

DeviceTime steady_time(const void*) {
    return device_time_us(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

}  // namespace

template <typename Message>
void FrontEndServices::add(Message message) {
    message.sequence = sequence_++;
    std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
    bytes.resize(protocol::encode(message, bytes));
    waiting_.push_back(std::move(bytes));
}

void FrontEndServices::self_check(bool fails) {
    const selfcheck::Report report = selfcheck::run({&steady_time, nullptr});
    protocol::CheckMessage row;
    row.count = static_cast<std::uint8_t>(report.checks().size());
    for (const selfcheck::Check& check : report.checks()) {
        row.id = static_cast<std::uint16_t>(check.id);
        row.precision = static_cast<std::uint8_t>(check.precision);
        row.outcome = static_cast<std::uint8_t>(check.outcome);
        if (fails && row.index + 1 == row.count) {
            row.outcome = static_cast<std::uint8_t>(selfcheck::Outcome::fail);
        }
        row.limit = check.limit;
        row.measured = check.measured;
        add(row);
        ++row.index;
    }
}

void FrontEndServices::tell_calibration(std::uint16_t request) {
    protocol::CalibrationMessage message;
    message.request = request;
    message.tail = blob_;
    add(message);
}

protocol::AckResult FrontEndServices::keep_calibration(std::span<const std::uint8_t> blob) {
    if (!calibration::decode(blob).ok()) {
        return protocol::AckResult::failed;
    }
    blob_.assign(blob.begin(), blob.end());
    return protocol::AckResult::done;
}

void FrontEndServices::tell_block(const SampleBlock& block, double sample_rate_hz) {
    constexpr std::size_t kMostSamples =
        (protocol::kMaxMessageBytes - protocol::kFixedBytes<protocol::RawBlockMessage>) / sizeof(Sample);
    protocol::RawBlockMessage part;
    part.sensor = block.sensor;
    part.state = static_cast<std::uint8_t>(block.state);
    part.gain_step = block.gain_step;
    part.total = static_cast<std::uint16_t>(block.samples.size());
    part.full_scale = block.full_scale;
    part.scale = block.scale;
    part.block_sequence = blocks_++;
    part.sample_rate_millihertz = static_cast<std::uint32_t>(std::lround(1e3 * sample_rate_hz));
    part.time_us = to_us(midpoint(block, part.sample_rate_millihertz));
    part.overruns = block.overrun_count;
    for (std::size_t first = 0; first < block.samples.size(); first += kMostSamples) {
        std::vector<std::uint8_t> tail;
        for (const Sample& sample : block.samples.subspan(first, std::min(kMostSamples, block.samples.size() - first))) {
            for (const std::int32_t code : sample) {
                tail.resize(tail.size() + sizeof code);
                protocol::put(tail.data() + tail.size() - sizeof code, protocol::WireType::i32, code);
            }
        }
        part.first = static_cast<std::uint16_t>(first);
        part.tail = tail;
        add(part);
    }
}

void FrontEndServices::flush() {
    while (!waiting_.empty() && port_.send(waiting_.front()).ok()) {
        waiting_.pop_front();
    }
}

}  // namespace tricoil::sim
