// Reads recordings of raw ADC blocks: excitation state, repeat, sample, four channels.
#pragma once

#include <string>
#include <vector>

#include "core/signal/sample_block.hpp"

namespace tricoil::host {

/// One block of a recording. Channels have the order of the file.
struct CapturedBlock {
    Excitation state = Excitation::off;
    int repeat = 0;
    std::vector<Sample> samples;
};

struct Capture {
    std::vector<CapturedBlock> blocks;  // file order, equal lengths, every repeat with S1, S2 and S3
    std::int32_t full_scale = 0;        // largest code magnitude after centring
    bool offset_binary = false;         // the file has unsigned codes; they are centred here
};

/// Resolution of a converter in bits: a code that is not yet centred fits into 32 bits with a sign.
constexpr int kFewestBits = 8;
constexpr int kMostBits = 31;

/// Reads CSV with the header state,repeat,sample,adc0,adc1,adc2,adc3. `bits`: resolution of the converter.
/// Throws InputError for another resolution than kFewestBits to kMostBits; naming file and line, for a different header, wrong
/// column counts, values outside the converter's range, samples out of order, blocks of different length, or repeats without all
/// states.
Capture read_capture(const std::string& path, int bits);

}  // namespace tricoil::host
