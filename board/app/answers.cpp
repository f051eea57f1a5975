#include "board/app/answers.hpp"

#include "core/protocol/answers.hpp"

namespace tricoil::app {

void Answers::begin(HostLink& link) {
    link_ = &link;
    has_begun_ = false;
    next_ = 0;
    report_ = nullptr;
    store_ = nullptr;
}

void Answers::start(HostLink& link, const selfcheck::Report& report) {
    begin(link);
    report_ = &report;
}

void Answers::start(HostLink& link, const SampleBlock& block, std::uint32_t sample_rate_millihertz) {
    begin(link);
    block_ = block;
    sample_rate_millihertz_ = sample_rate_millihertz;
    ++blocks_;
}

void Answers::start(HostLink& link, CalibrationStore& store, std::uint16_t request) {
    begin(link);
    store_ = &store;
    request_ = request;
}

void Answers::send_pending(DeviceTime now) {
    if (link_ != nullptr && !has_begun_) {
        has_begun_ = true;
        last_sent_ = now;
    }
    while (link_ != nullptr) {
        const std::size_t before = next_;
        const std::size_t bytes = encode_next(now);
        if (bytes == 0 || !link_->has_session()) {
            link_ = nullptr;
            return;
        }
        if (!link_->send(buffer_.first(bytes))) {
            next_ = before;
            link_ = now - last_sent_ > kSendTimeout ? nullptr : link_;
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
    if (next_ >= report_->checks().size()) {
        return 0;
    }
    protocol::CheckMessage row = protocol::to_message(*report_, next_);
    row.sequence = messages_;
    row.time_us = to_us(now);
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
    protocol::RawBlockMessage part = protocol::to_message(block_, next_, sample_rate_millihertz_, codes);
    part.sequence = messages_;
    part.block_sequence = blocks_;
    next_ += part.tail.size() / sizeof(Sample);
    return protocol::encode(part, buffer_);
}

}  // namespace tricoil::app
