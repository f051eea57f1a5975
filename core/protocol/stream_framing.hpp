// Messages on byte streams (USB bulk, serial lines): message, CRC-32 (little-endian), all of it consistent-overhead byte stuffed
// (Cheshire and Baker 1999) so that it holds no zero, and a zero behind it. A reader finds its place again at the next zero.
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

/// Bytes that a message of `bytes` takes at most: CRC, one code byte per 254, the zero.
constexpr std::size_t framed_bytes(std::size_t bytes) { return bytes + kCrcBytes + (bytes + kCrcBytes) / 254 + 1 + 1; }
constexpr std::size_t kMaxFramedBytes = framed_bytes(kMaxMessageBytes);

/// Frames `message`, byte by byte, through put(position, byte), which is also called again for positions within the last 255;
/// returns the bytes that it is then, at most framed_bytes().
template <typename Put>
std::size_t frame_through(std::span<const std::uint8_t> message, Put put);

/// Frames `message` into `out`; returns the bytes written, 0 if they do not fit.
std::size_t frame(std::span<const std::uint8_t> message, std::span<std::uint8_t> out);

/// Finds messages in a stream, in a buffer that BasicStreamReader has. Whatever comes in, nothing is read or written out of
/// bounds, and at most one message is lost per damaged place.
class StreamReaderBase {
public:
    StreamReaderBase(const StreamReaderBase&) = delete;
    StreamReaderBase& operator=(const StreamReaderBase&) = delete;

    /// Takes one byte; true when it completes a message: message() holds it until the next call. A frame that is damaged is
    /// dropped, and error() says why until the next call.
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

/// Takes messages of at most `kBytes`; longer ones are oversize.
template <std::size_t kBytes>
class BasicStreamReader final : public StreamReaderBase {
public:
    BasicStreamReader() : StreamReaderBase(storage_) {}

private:
    std::array<std::uint8_t, framed_bytes(kBytes)> storage_{};
};
using StreamReader = BasicStreamReader<kMaxMessageBytes>;

namespace detail {

/// Writes stuffed bytes: a code byte ahead of every run without zeros.
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
