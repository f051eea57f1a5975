#include "sim/paper/paper_example.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tricoil::paper {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Rate kRangeRate{0.3, 0.2, 10 * kPi};      // (40) with Table 2: the same in all examples
constexpr Rate kAttitudeRate{0, 2 * kPi, 2 * kPi};  // (41)

}  // namespace

double Rate::at(double time_s) const { return offset + amplitude * std::sin(frequency_rad_s * time_s); }

const std::vector<std::string>& example_names() {
    static const std::vector<std::string> names{"I", "II", "III", "orientation", "IIIo"};
    return names;
}

Example example(std::string_view name) {
    // Table 2. A_alpha of III is unreadable in the scan ("8.5"); 8 pi reproduces the staircase of Fig. 3(c).
    const std::array<Example, 5> examples{{
        {"I", kRangeRate, paper_angle_rate(10 * kPi, 0), {}, {}},
        {"II", kRangeRate, {}, paper_angle_rate(0, 10 * kPi), {}},
        {"III", kRangeRate, paper_angle_rate(8 * kPi, 0), paper_angle_rate(1.5 * kPi, 0), {}},
        {"orientation", {}, {}, {}, kAttitudeRate},
        {"IIIo", kRangeRate, paper_angle_rate(8 * kPi, 0), paper_angle_rate(1.5 * kPi, 0), kAttitudeRate},
    }};
    const auto found = std::find_if(examples.begin(), examples.end(), [&](const Example& e) { return e.name == name; });
    if (found == examples.end()) {
        throw std::invalid_argument("unknown example '" + std::string(name) + "'");
    }
    return *found;
}

}  // namespace tricoil::paper
