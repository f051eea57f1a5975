// Recordings of raw ADC blocks: state, repeat, sample, four channels.
#pragma once

#include <string>
#include <vector>

#include "core/signal/sample_block.hpp"

namespace tricoil::host {

/// One block of a recording; channels in the order of the file.
struct CapturedBlock {
    Excitation state = Excitation::off;
    int repeat = 0;
    std::vector<Sample> samples;
};

struct Capture {
    std::vector<CapturedBlock> blocks;  // in the order of the file, all of one length, every repeat with S1, S2 and S3
    std::int32_t full_scale = 0;        // largest code magnitude after centring
    bool offset_binary = false;         // codes were unsigned and have been centred
};

/// Reads CSV with the header state,repeat,sample,adc0,adc1,adc2,adc3. `bits`: of the converter (8-31).
/// Throws InputError, naming file and line, for another header, wrong column counts, values that are no codes of that converter,
/// samples out of order, blocks of different length, or repeats that lack a state.
Capture read_capture(const std::string& path, int bits);

}  // namespace tricoil::host
