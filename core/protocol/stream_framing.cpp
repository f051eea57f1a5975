#include "core/protocol/stream_framing.hpp"

namespace tricoil::protocol {
std::size_t frame(std::span<const std::uint8_t> message, std::span<std::uint8_t> out) {
    if (message.empty() || message.size() > kMaxMessageBytes || framed_bytes(message.size()) > out.size()) {
        return 0;
    }
    return frame_through(message, [out](std::size_t at, std::uint8_t byte) { out[at] = byte; });
}

bool StreamReaderBase::push(std::uint8_t byte) {
    error_ = WireError::none;
    message_bytes_ = 0;
    if (byte == 0) {
        const bool complete = finish();
        size_ = 0;
        overflowed_ = false;
        return complete;
    }
    if (size_ == buffer_.size()) {
        overflowed_ = true;
    } else {
        buffer_[size_++] = byte;
    }
    return false;
}

bool StreamReaderBase::finish() {
    if (overflowed_) {
        error_ = WireError::oversize;
        return false;
    }
    if (size_ == 0) {
        return false;  // repeated zeros: no message
    }
    if (!unstuff()) {
        error_ = WireError::bad_framing;
        return false;
    }
    if (size_ <= kCrcBytes) {
        error_ = WireError::too_short;
        return false;
    }
    const std::size_t bytes = size_ - kCrcBytes;
    if (bytes > kMaxMessageBytes) {
        error_ = WireError::oversize;
        return false;
    }
    if (get_bytes(buffer_.data() + bytes, kCrcBytes) != crc32({buffer_.data(), bytes})) {
        error_ = WireError::bad_crc;
        return false;
    }
    message_bytes_ = bytes;
    return true;
}

/// Works in place: the read position is never behind the write position.
bool StreamReaderBase::unstuff() {
    std::size_t from = 0;
    std::size_t to = 0;
    while (from < size_) {
        const std::uint8_t code = buffer_[from++];
        if (code - std::size_t{1} > size_ - from) {
            return false;
        }
        for (std::uint8_t i = 1; i < code; ++i) {
            buffer_[to++] = buffer_[from++];
        }
        if (code != kLongestRun && from < size_) {
            buffer_[to++] = 0;
        }
    }
    size_ = to;
    return true;
}

void StreamReaderBase::reset() {
    size_ = 0;
    message_bytes_ = 0;
    overflowed_ = false;
    error_ = WireError::none;
}

}  // namespace tricoil::protocol
