#include "core/protocol/stream_framing.hpp"

#include "core/base/crc32.hpp"

namespace tricoil::protocol {
namespace {

constexpr std::size_t kCrcBytes = 4;
constexpr std::uint8_t kLongestRun = 0xFF;

/// Writes stuffed bytes: a code byte ahead of every run without zeros.
class Stuffer {
public:
    explicit Stuffer(std::span<std::uint8_t> out) : out_(out) {}

    void add(std::uint8_t byte) {
        if (byte != 0) {
            out_[at_++] = byte;
            ++run_;
        }
        if (byte == 0 || run_ == kLongestRun) {
            close_run();
        }
    }

    std::size_t finish() {
        out_[code_at_] = run_;
        out_[at_++] = 0;
        return at_;
    }

private:
    void close_run() {
        out_[code_at_] = run_;
        code_at_ = at_++;
        run_ = 1;
    }

    std::span<std::uint8_t> out_;
    std::size_t code_at_ = 0;
    std::size_t at_ = 1;
    std::uint8_t run_ = 1;
};

}  // namespace

std::size_t frame(std::span<const std::uint8_t> message, std::span<std::uint8_t> out) {
    if (message.empty() || message.size() > kMaxMessageBytes || framed_bytes(message.size()) > out.size()) {
        return 0;
    }
    Stuffer stuffer(out);
    for (const std::uint8_t byte : message) {
        stuffer.add(byte);
    }
    std::array<std::uint8_t, kCrcBytes> crc{};
    put_bytes(crc.data(), crc32(message), kCrcBytes);
    for (const std::uint8_t byte : crc) {
        stuffer.add(byte);
    }
    return stuffer.finish();
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
        return false;  // two zeros in a row: a pause
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

/// In place: what is read is never behind what is written.
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
