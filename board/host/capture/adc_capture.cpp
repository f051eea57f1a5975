#include "board/host/capture/adc_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "board/support/errors.hpp"
#include "board/support/table.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kHeader = "state,repeat,sample,adc0,adc1,adc2,adc3";
constexpr std::array kNames{"state", "repeat", "sample", "adc0", "adc1", "adc2", "adc3"};

Excitation parse_state(std::string_view field, const TextPlace& place) {
    for (int j = 0; j < kSourceCoils; ++j) {
        if (field == fmt::format("S{}", j + 1)) {
            return single_coil(j);
        }
    }
    throw InputError(fmt::format("{}: state '{}' is not S1, S2 or S3", place.str(), field.substr(0, 24)));
}

void check_block(const CapturedBlock& block, const Capture& capture, const TextPlace& place) {
    refuse_if(block.samples.size() != capture.blocks.front().samples.size(),
              "{}: the block that ends here has {} samples, the first has {}; the recording is incomplete", place,
              block.samples.size(), capture.blocks.front().samples.size());
}

void check_states(const Capture& capture, const std::string& path) {
    std::map<int, int> states_of_repeat;
    for (const CapturedBlock& block : capture.blocks) {
        int& seen = states_of_repeat[block.repeat];
        const int bit = 1 << coil_index(block.state);
        refuse_if((seen & bit) != 0, "{}: repeat {} holds state S{} twice", path, block.repeat, coil_index(block.state) + 1);
        seen |= bit;
    }
    for (const auto& [repeat, seen] : states_of_repeat) {
        refuse_if(seen != 7, "{}: repeat {} lacks a state; each needs S1, S2 and S3", path, repeat);
    }
}

/// Centres unsigned codes: the demodulator needs codes around zero.
void centre(Capture& capture, int bits) {
    const auto half = static_cast<std::int32_t>(std::int64_t{1} << (bits - 1));
    capture.full_scale = half - 1;
    capture.offset_binary = std::none_of(capture.blocks.begin(), capture.blocks.end(), [](const CapturedBlock& block) {
        return std::any_of(block.samples.begin(), block.samples.end(),
                           [](const Sample& s) { return *std::min_element(s.begin(), s.end()) < 0; });
    });
    for (CapturedBlock& block : capture.blocks) {
        for (Sample& sample : block.samples) {
            for (std::int32_t& code : sample) {
                code -= capture.offset_binary ? half : 0;
            }
        }
    }
}

}  // namespace

Capture read_capture(const std::string& path, int bits) {
    refuse_if(bits < kFewestBits || bits > kMostBits, "--bits: {} is not possible; give {} to {}", bits, kFewestBits, kMostBits);
    Table table(path);
    std::array<std::size_t, kNames.size()> columns;
    std::ranges::transform(kNames, columns.begin(), [&](const char* name) { return table.column(name, kHeader); });
    Capture capture;
    const int limit = static_cast<int>((std::int64_t{1} << bits) - 1);
    std::size_t last_line = 0;
    for (; table.next(); last_line = table.place().line) {
        const Excitation state = parse_state(table.cells()[columns[0]], table.place());
        const int repeat = table.whole(columns[1], 0, 1'000'000);
        const bool new_block =
            capture.blocks.empty() || capture.blocks.back().state != state || capture.blocks.back().repeat != repeat;
        if (new_block) {
            if (!capture.blocks.empty()) {
                check_block(capture.blocks.back(), capture, {path, last_line});
            }
            capture.blocks.push_back({state, repeat, {}});
        }
        auto& samples = capture.blocks.back().samples;
        const int sample_number = table.whole(columns[2], 0, 1'000'000);
        refuse_if(sample_number != static_cast<int>(samples.size()),
                  "{}: sample {} instead of {}; samples are missing or out of order", table.place(), sample_number,
                  samples.size());
        Sample sample;
        for (std::size_t c = 0; c < kChannels; ++c) {
            sample[c] = table.whole(columns[3 + c], -limit / 2 - 1, limit);
        }
        samples.push_back(sample);
    }
    refuse_if(capture.blocks.empty(), "{}: holds a header but no samples", path);
    check_block(capture.blocks.back(), capture, {path, last_line});
    check_states(capture, path);
    centre(capture, bits);
    return capture;
}

}  // namespace tricoil::host
