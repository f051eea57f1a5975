#include "board/host/run/wav_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace tricoil::host {
namespace {

constexpr std::uint32_t kStreamLength = 0xFFFFFFFF;  // unknown

template <typename T>
std::string_view bytes_of(const T* from, std::size_t count) {
    return {reinterpret_cast<const char*>(from), count * sizeof(T)};  // NOLINT: bytes as such
}

/// Header with little-endian numbers, as on every supported host.
std::string header(std::uint32_t rate_hz, std::uint64_t bytes) {
    constexpr std::uint32_t kHeaderBytes = 36;  // after the length of the file
    constexpr std::uint32_t kFrameBytes = sizeof(Sample);
    const bool is_known = bytes + kHeaderBytes < kStreamLength;
    const auto size = is_known ? static_cast<std::uint32_t>(bytes) : kStreamLength;
    const std::uint32_t file_size = is_known ? size + kHeaderBytes : kStreamLength;
    const std::array<std::uint32_t, 5> format{16, 1U + (kChannels << 16U), rate_hz, rate_hz * kFrameBytes,
                                              kFrameBytes + (32U << 16U)};  // PCM
    return fmt::format("RIFF{}WAVEfmt {}data{}", bytes_of(&file_size, 1), bytes_of(format.data(), format.size()),
                       bytes_of(&size, 1));
}

}  // namespace

Status WavRecorder::do_start(const signal::AcquisitionPlan& plan) {
    const bool is_first = rate_hz_ == 0;
    rate_hz_ = static_cast<std::uint32_t>(std::lround(plan.params.sample_rate_hz));
    scaled_.resize(static_cast<std::size_t>(plan.block_samples));
    if (is_first) {
        file_.write(header(rate_hz_, kStreamLength));
    }
    return sampler_.start(plan);
}

Status WavRecorder::do_poll(SampleBlock& block) {
    const Status status = sampler_.poll(block);
    if (!status.ok() && status.code() != StatusCode::timed_out) {
        return status;
    }
    std::ranges::fill(scaled_, Sample{});
    const std::int64_t unit = status.ok() ? (std::int64_t{1} << 31U) / (std::int64_t{block.full_scale} + 1) : 0;
    for (std::size_t n = 0; status.ok() && n < scaled_.size(); ++n) {
        std::ranges::transform(block.samples[n], scaled_[n].begin(),
                               [&](std::int32_t code) { return static_cast<std::int32_t>(code * unit); });
    }
    const std::string_view bytes = bytes_of(scaled_.data(), scaled_.size());
    file_.write(bytes);
    bytes_ += bytes.size();
    if (is_live_) {
        file_.flush();
    }
    return status;
}

void WavRecorder::commit() {
    file_.replace(0, header(rate_hz_, bytes_));
    file_.commit();
}

}  // namespace tricoil::host
