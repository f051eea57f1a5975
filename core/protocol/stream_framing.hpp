// Messages on byte streams (USB bulk, serial lines): message, CRC-32 (little-endian), all of it consistent-overhead byte stuffed
// (Cheshire and Baker 1999) so that it holds no zero, and a zero behind it. A reader finds its place again at the next zero.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::protocol {

/// Bytes that a message of `bytes` takes at most: CRC, one code byte per 254, the zero.
constexpr std::size_t framed_bytes(std::size_t bytes) { return bytes + 4 + (bytes + 4) / 254 + 1 + 1; }
constexpr std::size_t kMaxFramedBytes = framed_bytes(kMaxMessageBytes);

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

}  // namespace tricoil::protocol
