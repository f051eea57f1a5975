// Samples of a WAV file or stream: whole numbers of 16, 24 or 32 bits, or floating point.
#pragma once

#include <cstdint>
#include <span>

#include "board/support/line_reader.hpp"

namespace tricoil::host {

class WavSamples {
public:
    /// Reads the header. Throws InputError, naming the file, unless it is that of a WAV file that is not compressed.
    explicit WavSamples(LineReader bytes);

    [[nodiscard]] std::size_t channels() const { return channels_; }
    [[nodiscard]] double rate_hz() const { return rate_hz_; }

    /// The next sample of each channel, full scale 1; false at the end. Throws InputError for an end within a frame or before
    /// that of the header, and for a value that is not finite.
    bool next(std::span<double> values);

private:
    std::uint64_t number(std::uint64_t bytes);
    void read_format(std::uint64_t bytes);

    LineReader bytes_;
    std::size_t channels_ = 0;
    double rate_hz_ = 0;
    std::uint64_t bits_ = 0;
    bool is_float_ = false;
    std::uint64_t frames_left_ = 0;
};

}  // namespace tricoil::host
