#include "core/protocol/iso_tp.hpp"

#include <algorithm>

namespace tricoil::protocol {
namespace {

constexpr std::uint8_t kFirst = 0x10;
constexpr std::uint8_t kConsecutive = 0x20;
constexpr std::uint8_t kFlowControl = 0x30;
constexpr std::size_t kFirstHead = 2;
constexpr std::uint32_t kNoLimit = 0xFFFFFFFFU;

constexpr std::uint8_t kind(std::uint8_t byte) { return byte & 0xF0U; }

/// Separation time as coded in flow control: milliseconds up to 127, hundreds of microseconds from 0xF1 to 0xF9.
constexpr std::uint32_t gap_of(std::uint8_t code) {
    if (code <= 0x7F) {
        return code * 1000U;
    }
    return code >= 0xF1 && code <= 0xF9 ? (code - 0xF0U) * 100U : 127'000U;
}

}  // namespace

bool Segmenter::begin(std::span<const std::uint8_t> message) {
    if (busy() || message.size() <= kMaxFrameBytes || message.size() > kMaxMessageBytes) {
        return false;
    }
    *this = {};
    message_ = message;
    return true;
}

std::size_t Segmenter::next(std::span<std::uint8_t, kMaxFrameBytes> data) {
    if (!busy() || window_ == 0) {
        return 0;
    }
    std::size_t head = 1;
    if (at_ == 0) {
        data[0] = static_cast<std::uint8_t>(kFirst | (message_.size() >> 8U));
        data[1] = static_cast<std::uint8_t>(message_.size());
        head = kFirstHead;
    } else {
        data[0] = static_cast<std::uint8_t>(kConsecutive | (serial_ & 0x0FU));
    }
    ++serial_;
    const std::size_t part = std::min(kMaxFrameBytes - head, message_.size() - at_);
    std::copy_n(message_.begin() + static_cast<std::ptrdiff_t>(at_), part, data.begin() + static_cast<std::ptrdiff_t>(head));
    at_ += part;
    window_ -= window_ == kNoLimit ? 0U : 1U;
    const std::size_t length = can_fd_length(head + part);
    std::fill(data.begin() + static_cast<std::ptrdiff_t>(head + part), data.begin() + static_cast<std::ptrdiff_t>(length),
              std::uint8_t{0});
    return length;
}

void Segmenter::on_flow_control(std::span<const std::uint8_t> data) {
    if (!waits() || data.size() < 3 || kind(data[0]) != kFlowControl) {
        return;
    }
    const std::uint8_t status = data[0] & 0x0FU;
    if (status == 0) {
        window_ = data[1] == 0 ? kNoLimit : data[1];
        gap_us_ = gap_of(data[2]);
    } else if (status != 1) {  // 1: wait
        cancel();
    }
}

SegmentEvent ReassemblerBase::on_frame(std::span<const std::uint8_t> data) {
    if (data.empty()) {
        return SegmentEvent::none;
    }
    switch (kind(data[0])) {
        case kFirst:
            return begin(data);
        case kConsecutive:
            return go_on(data);
        default:
            return SegmentEvent::none;
    }
}

SegmentEvent ReassemblerBase::begin(std::span<const std::uint8_t> data) {
    const bool interrupted = busy();
    cancel();
    const std::size_t size = data.size() < kFirstHead ? 0 : (data[0] & 0x0FU) << 8U | data[1];
    if (data.size() != kMaxFrameBytes || size <= kMaxFrameBytes || size > buffer_.size()) {
        return SegmentEvent::error;
    }
    size_ = size;
    serial_ = 1;
    append(data.subspan(kFirstHead));
    return interrupted ? SegmentEvent::answer_anew : SegmentEvent::answer;
}

SegmentEvent ReassemblerBase::go_on(std::span<const std::uint8_t> data) {
    if (!busy()) {
        return SegmentEvent::none;  // segment of a dropped message
    }
    const std::size_t expected = can_fd_length(1 + std::min(kMaxFrameBytes - 1, size_ - at_));
    if ((data[0] & 0x0FU) != (serial_ & 0x0FU) || data.size() != expected) {
        cancel();
        return SegmentEvent::error;
    }
    ++serial_;
    append(data.subspan(1));
    return busy() ? SegmentEvent::taken : SegmentEvent::complete;
}

void ReassemblerBase::append(std::span<const std::uint8_t> data) {
    const std::size_t part = std::min(data.size(), size_ - at_);
    std::copy_n(data.begin(), part, buffer_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += part;
}

}  // namespace tricoil::protocol
