#include "board/host/capture/wav_samples.hpp"

#include <bit>
#include <cmath>
#include <limits>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

// Names of chunks, as little-endian numbers.
constexpr std::uint64_t kWave = 0x45564157;
constexpr std::uint64_t kFormat = 0x20746D66;
constexpr std::uint64_t kData = 0x61746164;
constexpr std::uint64_t kExtensible = 0xFFFE;           // the code of the format follows later
constexpr std::uint64_t kShortestStream = 0x7FFF'0000;  // a length from here on, or 0: the writer did not know it
constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();

}  // namespace

/// Little-endian.
std::uint64_t WavSamples::number(std::uint64_t bytes) {
    std::uint64_t value = 0;
    for (std::uint64_t n = 0; n < bytes; ++n) {
        const int byte = bytes_.take();
        refuse_if(byte < 0, "{}: the WAV file ends in the middle of a frame or before the length in its header; record it again",
                  bytes_.path());
        value |= n < 8 ? static_cast<std::uint64_t>(byte) << (8 * n) : 0;
    }
    return value;
}

WavSamples::WavSamples(LineReader bytes) : bytes_(std::move(bytes)) {
    (void)number(8);
    refuse_if(number(4) != kWave, "{}: is a RIFF file, but not WAVE", bytes_.path());
    for (;;) {
        const std::uint64_t chunk = number(4);
        const std::uint64_t size = number(4);
        if (chunk == kData) {
            const std::uint64_t frame = channels_ * bits_ / 8;
            const bool is_known = size > 0 && size < kShortestStream;
            refuse_if(frame == 0, "{}: the WAV header has no format", bytes_.path());
            refuse_if(is_known && size % frame != 0,
                      "{}: the WAV file ends in the middle of a frame of {} channels; record it again", bytes_.path(), channels_);
            frames_left_ = is_known ? size / frame : kUnknown;
            return;
        }
        if (chunk == kFormat) {
            read_format(size);
        } else {
            (void)number(size + size % 2);
        }
    }
}

void WavSamples::read_format(std::uint64_t bytes) {
    std::uint64_t format = number(2);
    channels_ = number(2);
    rate_hz_ = static_cast<double>(number(4));
    (void)number(6);
    bits_ = number(2);
    std::uint64_t read = 16;
    if (format == kExtensible && bytes >= 26) {
        (void)number(8);
        format = number(2);
        read = 26;
    }
    is_float_ = format == 3;
    refuse_if(format != 1 && !is_float_, "{}: is a compressed WAV file (format {}); write PCM", bytes_.path(), format);
    refuse_if(is_float_ ? bits_ != 32 && bits_ != 64 : bits_ != 16 && bits_ != 24 && bits_ != 32,
              "{}: has samples of {} bits; write 16, 24 or 32", bytes_.path(), bits_);
    refuse_if(channels_ == 0 || channels_ > 64 || !(rate_hz_ > 0) || bytes < read, "{}: the WAV header is damaged",
              bytes_.path());
    (void)number(bytes - read + bytes % 2);
}

bool WavSamples::next(std::span<double> values) {
    if (frames_left_ == 0 || (frames_left_ == kUnknown && bytes_.at_end())) {
        return false;
    }
    frames_left_ -= frames_left_ == kUnknown ? 0 : 1;
    for (double& value : values) {
        const std::uint64_t code = number(bits_ / 8);
        const auto shifted = static_cast<std::int64_t>(code << (64 - bits_));
        value = !is_float_    ? std::ldexp(static_cast<double>(shifted), -63)
                : bits_ == 32 ? static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(code)))
                              : std::bit_cast<double>(code);
        refuse_if(!std::isfinite(value), "{}: the WAV file has a sample that is not finite", bytes_.path());
    }
    return true;
}

}  // namespace tricoil::host
