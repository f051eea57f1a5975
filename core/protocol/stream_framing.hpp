// Messages on byte streams (USB bulk, serial lines): message and CRC-32 (little-endian), encoded with consistent-overhead byte
// stuffing (Cheshire and Baker 1999) so that they contain no zero, then a zero. A reader resynchronises at the next zero.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/crc32.hpp"
#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::protocol {

constexpr std::size_t kCrcBytes = 4;
constexpr std::uint8_t kLongestRun = 0xFF;

/// Maximum length of a framed message of `bytes`: CRC, one code byte per 254, the zero.
constexpr std::size_t framed_bytes(std::size_t bytes) { return bytes + kCrcBytes + (bytes + kCrcBytes) / 254 + 1 + 1; }
constexpr std::size_t kMaxFramedBytes = framed_bytes(kMaxMessageBytes);

/// Frames `message` byte by byte with put(position, byte). put() may be called again for one of the last 255 positions. Returns
/// the framed length, at most framed_bytes().
template <typename Put>
std::size_t frame_through(std::span<const std::uint8_t> message, Put put);

/// Frames `message` into `out`. Returns the bytes written, or 0 if they do not fit.
std::size_t frame(std::span<const std::uint8_t> message, std::span<std::uint8_t> out);

/// Finds messages in a stream, in the buffer of BasicStreamReader. Any input is safe. A damaged place loses at most one message.
class StreamReaderBase {
public:
    StreamReaderBase(const StreamReaderBase&) = delete;
    StreamReaderBase& operator=(const StreamReaderBase&) = delete;

    /// Processes one byte. True if it completes a message: message() is valid until the next call. A damaged frame is dropped;
    /// error() gives the reason until the next call.
    bool push(std::uint8_t byte);

    [[nodiscard]] std::span<const std::uint8_t> message() const { return {buffer_.data(), message_bytes_}; }
    [[nodiscard]] WireError error() const { return error_; }
    void reset();

protected:
    explicit StreamReaderBase(std::span<std::uint8_t> buffer) : buffer_(buffer) {}
    ~StreamReaderBase() = default;

private:
    bool finish();
    [[nodiscard]] bool unstuff();

    std::span<std::uint8_t> buffer_;
    std::size_t size_ = 0;
    std::size_t message_bytes_ = 0;
    bool overflowed_ = false;
    WireError error_ = WireError::none;
};

/// For messages of at most `kBytes`; longer ones are oversize.
template <std::size_t kBytes>
class BasicStreamReader final : public StreamReaderBase {
public:
    BasicStreamReader() : StreamReaderBase(storage_) {}

private:
    std::array<std::uint8_t, framed_bytes(kBytes)> storage_{};
};
using StreamReader = BasicStreamReader<kMaxMessageBytes>;

namespace detail {

/// Writes stuffed bytes: a code byte before every run without zeros.
template <typename Put>
class Stuffer {
public:
    explicit Stuffer(Put& put) : put_(put) {}

    void add(std::uint8_t byte) {
        if (byte != 0) {
            put_(at_++, byte);
            ++run_;
        }
        if (byte == 0 || run_ == kLongestRun) {
            close_run();
        }
    }

    std::size_t finish() {
        put_(code_at_, run_);
        put_(at_++, std::uint8_t{0});
        return at_;
    }

private:
    void close_run() {
        put_(code_at_, run_);
        code_at_ = at_++;
        run_ = 1;
    }

    Put& put_;
    std::size_t code_at_ = 0;
    std::size_t at_ = 1;
    std::uint8_t run_ = 1;
};

}  // namespace detail

template <typename Put>
std::size_t frame_through(std::span<const std::uint8_t> message, Put put) {
    detail::Stuffer<Put> stuffer(put);
    for (const std::uint8_t byte : message) {
        stuffer.add(byte);
    }
    std::array<std::uint8_t, kCrcBytes> crc{};
    put_bytes(crc.data(), crc32(message), crc.size());
    for (const std::uint8_t byte : crc) {
        stuffer.add(byte);
    }
    return stuffer.finish();
}

}  // namespace tricoil::protocol
