#include "board/app/answers.hpp"

#include <algorithm>

namespace tricoil::app {

void Answers::begin(HostLink& link) {
    link_ = &link;
    has_begun_ = false;
    next_ = 0;
    report_ = nullptr;
    store_ = nullptr;
}

void Answers::tell(HostLink& link, const selfcheck::Report& report) {
    begin(link);
    report_ = &report;
}

void Answers::tell(HostLink& link, const SampleBlock& block, std::uint32_t sample_rate_millihertz) {
    begin(link);
    block_ = block;
    sample_rate_millihertz_ = sample_rate_millihertz;
    ++blocks_;
}

void Answers::tell(HostLink& link, CalibrationStore& store, std::uint16_t request) {
    begin(link);
    store_ = &store;
    request_ = request;
}

void Answers::pump(DeviceTime now) {
    if (link_ != nullptr && !has_begun_) {
        has_begun_ = true;
        last_sent_ = now;
    }
    while (link_ != nullptr) {
        const std::size_t before = next_;
        const std::size_t bytes = encode_next(now);
        if (bytes == 0 || !link_->is_greeted()) {
            link_ = nullptr;
            return;
        }
        if (!link_->send(buffer_.first(bytes))) {
            next_ = before;
            link_ = now - last_sent_ > kPatience ? nullptr : link_;
            return;
        }
        ++messages_;
        last_sent_ = now;
    }
}

/// Encodes the next message and advances. 0: nothing is left.
std::size_t Answers::encode_next(DeviceTime now) {
    if (report_ != nullptr) {
        return encode_row(now);
    }
    return store_ != nullptr ? encode_calibration(now) : encode_part();
}

std::size_t Answers::encode_row(DeviceTime now) {
    const auto& checks = report_->checks();
    if (next_ >= checks.size()) {
        return 0;
    }
    const selfcheck::Check& check = checks[next_];
    protocol::CheckMessage row;
    row.sequence = messages_;
    row.time_us = to_us(now);
    row.id = static_cast<std::uint16_t>(check.id);
    row.precision = static_cast<std::uint8_t>(check.precision);
    row.outcome = static_cast<std::uint8_t>(check.outcome);
    row.index = static_cast<std::uint8_t>(next_);
    row.count = static_cast<std::uint8_t>(checks.size());
    row.limit = check.limit;
    row.measured = check.measured;
    ++next_;
    return protocol::encode(row, buffer_);
}

std::size_t Answers::encode_calibration(DeviceTime now) {
    if (next_ > 0) {
        return 0;
    }
    ++next_;
    calibration::Blob blob{};
    protocol::CalibrationMessage message;
    message.sequence = messages_;
    message.time_us = to_us(now);
    message.request = request_;
    message.tail = store_->read(blob).ok() ? std::span<const std::uint8_t>(blob) : std::span<const std::uint8_t>();
    return protocol::encode(message, buffer_);
}

std::size_t Answers::encode_part() {
    if (next_ >= block_.samples.size()) {
        return 0;
    }
    std::array<std::uint8_t, kSamplesOfPart * sizeof(Sample)> codes;
    const auto part = block_.samples.subspan(next_, std::min(kSamplesOfPart, block_.samples.size() - next_));
    std::uint8_t* at = codes.data();
    for (const Sample& sample : part) {
        for (const std::int32_t code : sample) {
            protocol::put_bytes(at, static_cast<std::uint32_t>(code), sizeof code);
            at += sizeof code;
        }
    }
    protocol::RawBlockMessage message;
    message.sequence = messages_;
    message.time_us = to_us(midpoint(block_, sample_rate_millihertz_));
    message.sensor = block_.sensor;
    message.state = static_cast<std::uint8_t>(block_.state);
    message.gain_step = block_.gain_step;
    message.first = static_cast<std::uint16_t>(next_);
    message.total = static_cast<std::uint16_t>(block_.samples.size());
    message.full_scale = block_.full_scale;
    message.scale = block_.scale;
    message.state_sequence = block_.sequence;
    message.block_sequence = blocks_;
    message.sample_rate_millihertz = sample_rate_millihertz_;
    message.overruns = block_.overrun_count;
    message.tail = std::span<const std::uint8_t>(codes).first(part.size_bytes());
    next_ += part.size();
    return protocol::encode(message, buffer_);
}

}  // namespace tricoil::app
