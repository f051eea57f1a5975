// The tables of HARDWARE.md equal those computed from the code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "board/nucleo_g474re/measuring.hpp"
#include "tests/stm32g4/hardware_tables.hpp"

namespace tricoil::test {
namespace {

TEST(HardwarePage, HasTheTablesComputedFromTheCode) {
    std::ifstream file(TRICOIL_SOURCE_DIR "/board/nucleo_g474re/HARDWARE.md");
    ASSERT_TRUE(file.is_open());
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    for (const HardwareTable& table : hardware_tables()) {
        EXPECT_NE(page.find(table.text), std::string::npos) << "HARDWARE.md: the table of " << table.name << " must be:\n"
                                                            << table.text;
    }
}

TEST(HardwarePage, NamesEveryPinOfTheBoardOnce) {
    const std::string pins = hardware_tables().front().text;
    std::ifstream file(TRICOIL_SOURCE_DIR "/board/nucleo_g474re/pins.hpp");
    ASSERT_TRUE(file.is_open());
    int declared = 0;
    for (std::string line; std::getline(file, line);) {
        const std::size_t at = line.find("constexpr PinName ");
        const std::size_t open = line.find("{'");
        if (at != 0 || open == std::string::npos) {
            continue;
        }
        ++declared;
        const std::string name = "| P" + line.substr(open + 2, 1) + line.substr(open + 6, line.find('}') - open - 6) + " |";
        const std::size_t found = pins.find(name);
        ASSERT_NE(found, std::string::npos) << line;
        EXPECT_EQ(pins.find(name, found + 1), std::string::npos) << "twice: " << line;
    }
    EXPECT_GT(declared, 15);
    EXPECT_EQ(std::count(pins.begin(), pins.end(), '\n'), declared + 2) << "the table has only pins of the board";
}

/// The circuits are checked at these carriers and windows (tests/circuits).
TEST(HardwarePage, CircuitsAreCheckedWithTheModesOfTheBoard) {
    std::ifstream file(TRICOIL_SOURCE_DIR "/board/nucleo_g474re/circuits/modes.csv");
    ASSERT_TRUE(file.is_open());
    const std::string stated{std::istreambuf_iterator<char>(file), {}};
    std::string modes = "mode,multiplexing,frame_hz,guard_s,window_s,f1_hz,f2_hz,f3_hz,low1_hz,low2_hz,low3_hz\n";
    constexpr std::array kNames{"TDM", "FDM", "two bands"};
    constexpr std::array kKinds{"tdm", "fdm", "dual-band"};
    for (const app::MeasuringMode& mode : nucleo_g474re::kModes) {
        const signal::AcquisitionPlan& plan = mode.plan;
        const auto& hz = plan.params.carrier_hz;
        const auto kind = static_cast<std::size_t>(plan.params.multiplexing);
        char line[200];
        std::snprintf(line, sizeof line, "%s %.0f,%s,%.3f,%.6e,%.6e,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f\n", kNames[kind],
                      10 * std::round(plan.params.frame_rate_hz / 10), kKinds[kind], plan.params.frame_rate_hz,
                      plan.block_s() - plan.window_s(), plan.window_s(), hz[0], hz[1], hz[2], hz[3], hz[4], hz[5]);
        modes += line;
    }
    EXPECT_EQ(stated, modes);
}

}  // namespace
}  // namespace tricoil::test
