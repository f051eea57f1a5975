// The carriers of all modes of the tracker board, as its DACs play them.
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "board/nucleo_g474re/measuring.hpp"
#include "drivers/stm32g4/carrier_player.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr float kFullCodes = AcquisitionParams{}.carrier_amplitude_codes;

/// A player with plain structures as registers.
struct Bench {
    explicit Bench(std::size_t values) : memory(values) {}

    /// Amplitudes of the currents, relative to full drive, one table per coil.
    [[nodiscard]] std::vector<std::vector<double>> currents() const {
        std::vector<std::vector<double>> all;
        auto next = memory.begin();
        for (const unsigned number : {5U, 6U, 7U}) {
            std::vector<double>& table = all.emplace_back();
            for (std::uint32_t n = 0; n < dma.channel[number - 1].CNDTR; ++n) {
                table.push_back((*next++ - kDacMiddle) / static_cast<double>(kFullCodes));
            }
        }
        return all;
    }

    DacRegisters pair{};
    DacRegisters single{};
    DmaRegisters dma{};
    DmamuxRegisters multiplexer{};
    std::vector<std::uint16_t> memory;
    CarrierPlayer player{{pair,
                          single,
                          {DmaChannel{dma, multiplexer, 5, 6}, {dma, multiplexer, 6, 7}, {dma, multiplexer, 7, 41}},
                          dac::MCR_MODE1_pin,
                          memory}};
};

double largest(const std::vector<double>& wave) {
    const auto [least, most] = std::minmax_element(wave.begin(), wave.end());
    return (*most - *least) / 2;
}

/// Parts within their tolerances must not end a measurement. In TDM one coil is driven at a time.
TEST(Carriers, PeakOfAllCurrentsIsBelowTheOverCurrentLimit) {
    constexpr double kFullDrive_v = 0.698;  // reference.full_drive_v of the circuits
    constexpr double kTolerance = 1.05;
    for (const app::MeasuringMode& mode : nucleo_g474re::kModes) {
        Bench bench(2600);
        ASSERT_TRUE(bench.player.load(mode.plan, nucleo_g474re::kOversampling, kFullCodes).ok());
        const auto currents = bench.currents();
        std::vector<double> sum(static_cast<std::size_t>(mode.plan.window_samples * nucleo_g474re::kOversampling));
        for (std::size_t n = 0; n < sum.size(); ++n) {
            for (std::size_t coil = 0; coil < (mode.plan.is_tdm() ? 1U : currents.size()); ++coil) {
                sum[n] += currents[coil][n % currents[coil].size()];
            }
        }
        EXPECT_LT(kTolerance * kFullDrive_v * largest(sum), static_cast<double>(nucleo_g474re::kMaxReference_v))
            << mode.plan.window_cycles[1];
    }
}

TEST(Carriers, TwoBandsShareEachCurrent) {
    Bench bench(2600);
    ASSERT_TRUE(bench.player.load(nucleo_g474re::kModes.back().plan, nucleo_g474re::kOversampling, kFullCodes).ok());
    const auto currents = bench.currents();
    EXPECT_EQ(currents[0].size(), 1200U);
    EXPECT_EQ(currents[1].size(), 800U);
    EXPECT_EQ(currents[2].size(), 600U);
    for (std::size_t coil = 0; coil < currents.size(); ++coil) {
        constexpr std::array kHigh{32.0, 42.0, 56.0};  // cycles in a block
        EXPECT_NEAR(largest(currents[coil]), 0.27 + 0.8 * 0.65 * 32 / kHigh[coil], 0.02) << coil;
    }
}

TEST(Carriers, TablesThatDoNotFitAreRefused) {
    Bench bench(2599);
    const Status status = bench.player.load(nucleo_g474re::kModes.back().plan, nucleo_g474re::kOversampling, kFullCodes);
    EXPECT_EQ(status.code(), StatusCode::invalid_argument);
    EXPECT_TRUE(bench.player.load(nucleo_g474re::kModes.front().plan, nucleo_g474re::kOversampling, kFullCodes).ok());
}

}  // namespace
}  // namespace tricoil::stm32g4
