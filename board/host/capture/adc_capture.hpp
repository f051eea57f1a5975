// Reads captures of raw samples block by block: tables of codes or volts, and WAV files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "board/host/capture/wav_samples.hpp"
#include "board/support/table.hpp"

namespace tricoil::host {

struct CapturedBlock {
    int coil = -1;  // the driven source coil; -1: all three, at their own carriers
    int repeat = 0;
    std::uint64_t begin = 0;     // index of the first sample in the capture
    std::vector<double> values;  // sample by sample, each with all channels

    [[nodiscard]] bool drives(int j) const { return coil == j || coil < 0; }
};

struct CaptureForm {
    static constexpr int kFewestBits = 8;
    static constexpr int kMostBits = 31;

    int bits = 16;                     // of the codes of a table; a fraction in the first sample: volts
    std::vector<std::string> columns;  // of the channels, by name or by number from 1; empty: all
    bool follows = false;              // waits for more at the end of a file
};

class CaptureReader {
public:
    /// Throws InputError for another resolution than kFewestBits to kMostBits, a damaged header, a missing column, and another
    /// number of channels than three or four.
    CaptureReader(const std::string& path, const CaptureForm& form);

    /// The next block. A capture without states has blocks of `samples`; an incomplete last one is left out. Throws InputError,
    /// naming the place, for values that are not finite or outside the converter's range, samples out of order, and states whose
    /// blocks differ in length.
    bool next(CapturedBlock& block, std::size_t samples);

    /// True for a table with the columns state (S1 to S3), repeat and sample: the coils are driven in turn.
    [[nodiscard]] bool has_states() const { return !order_.empty(); }
    [[nodiscard]] const std::vector<std::string>& channels() const { return channels_; }
    /// Index of a channel by the name or the number of its column. Throws InputError.
    [[nodiscard]] std::size_t channel_of(const std::string& name) const;
    /// Of a WAV file; 0: unknown.
    [[nodiscard]] double rate_hz() const { return wav_ ? wav_->rate_hz() : 0; }
    /// Largest value; 0: unknown.
    [[nodiscard]] double full_scale() const { return full_scale_; }
    [[nodiscard]] const std::string& path() const { return path_; }
    /// The capture ends when the user ends it, also within a block.
    [[nodiscard]] bool follows() const { return follows_; }

private:
    bool next_sample();
    [[nodiscard]] std::size_t column_of(const std::string& name) const;

    std::string path_;
    bool follows_;
    std::optional<Table> table_;
    std::optional<WavSamples> wav_;
    std::vector<double> frame_;         // of a WAV file
    std::vector<std::string> names_;    // of all columns
    std::vector<std::size_t> order_;    // columns of state, repeat and sample
    std::vector<std::size_t> columns_;  // of the channels
    std::vector<std::string> channels_;
    int codes_ = 0;  // of the converter; 0: volts
    double full_scale_ = 0;
    std::optional<double> centre_;  // of the codes; known after the first block
    std::size_t block_samples_ = 0;

    // The first sample of the next block.
    bool has_sample_ = false;
    int coil_ = -1;
    int repeat_ = 0;
    int number_ = 0;
    std::vector<double> values_;
    std::uint64_t read_ = 0;
};

}  // namespace tricoil::host
