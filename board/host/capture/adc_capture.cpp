#include "board/host/capture/adc_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kHeader = "state,repeat,sample,adc0,adc1,adc2,adc3";
constexpr std::size_t kFields = 3 + kChannels;

Excitation parse_state(std::string_view field, const TextPlace& place) {
    for (int j = 0; j < kSourceCoils; ++j) {
        if (field == fmt::format("S{}", j + 1)) {
            return single_coil(j);
        }
    }
    throw InputError(fmt::format("{}: state '{}' is not S1, S2 or S3", place.str(), field.substr(0, 24)));
}

std::int64_t parse_integer(std::string_view field, const TextPlace& place, std::int64_t low, std::int64_t high) {
    const double value = parse_number(field, place);
    refuse_if(value != std::floor(value) || value < static_cast<double>(low) || value > static_cast<double>(high),
              "{}: {} is not a whole number from {} to {}", place, field, low, high);
    return static_cast<std::int64_t>(value);
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
    const auto lines = read_lines(path);
    refuse_if(lines.front() != kHeader, "{}:1: the header must be {}", path, kHeader);
    Capture capture;
    const std::int64_t limit = (std::int64_t{1} << bits) - 1;
    for (std::size_t i = 1; i < lines.size(); ++i) {
        const TextPlace place{path, i + 1};
        if (lines[i].empty()) {
            continue;
        }
        const auto fields = split(lines[i], ',');
        refuse_if(fields.size() != kFields, "{}: {} columns; {} are needed", place, fields.size(), kFields);
        const Excitation state = parse_state(fields[0], place);
        const auto repeat = static_cast<int>(parse_integer(fields[1], place, 0, 1'000'000));
        const bool new_block =
            capture.blocks.empty() || capture.blocks.back().state != state || capture.blocks.back().repeat != repeat;
        if (new_block) {
            if (!capture.blocks.empty()) {
                check_block(capture.blocks.back(), capture, {path, i});
            }
            capture.blocks.push_back({state, repeat, {}});
        }
        auto& samples = capture.blocks.back().samples;
        const auto index = static_cast<std::int64_t>(samples.size());
        refuse_if(parse_integer(fields[2], place, 0, 1'000'000) != index,
                  "{}: sample {} instead of {}; samples are missing or out of order", place, fields[2], index);
        Sample sample;
        for (std::size_t c = 0; c < kChannels; ++c) {
            sample[c] = static_cast<std::int32_t>(parse_integer(fields[3 + c], place, -limit / 2 - 1, limit));
        }
        samples.push_back(sample);
    }
    refuse_if(capture.blocks.empty(), "{}: holds a header but no samples", path);
    check_block(capture.blocks.back(), capture, {path, lines.size()});
    check_states(capture, path);
    centre(capture, bits);
    return capture;
}

}  // namespace tricoil::host
