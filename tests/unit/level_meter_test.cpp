// Rows of tricoil device watch --levels.
#include "board/support/level_meter.hpp"

#include <gtest/gtest.h>

namespace tricoil::host {
namespace {

Json row_of(const std::vector<double>& couplings) {
    LevelMeter meter;
    std::uint32_t sequence = 0;
    for (const double coupling : couplings) {
        MeasuredColumn<double> column;
        column.state = Excitation::s1;
        column.in_phase = Vec3<double>(coupling, 0, 0);
        column.level[0] = 16384;
        meter.take(protocol::to_message(column, sequence++));
    }
    return meter.take_row(0);
}

TEST(LevelMeter, MeansAreOfTheColumnsThatCame) {
    for (const std::size_t columns : {1U, 2U, 4U}) {
        const Json row = row_of(std::vector<double>(columns, 0.25));
        EXPECT_EQ(row["columns"], columns);
        EXPECT_NEAR(row["coupling"][0].get<double>(), 0.25, 1e-6) << columns;
        EXPECT_NEAR(row["level"][0].get<double>(), 0.25, 1e-6) << columns;
    }
}

TEST(LevelMeter, NoNoiseAndNoSnrBelowThreeColumns) {
    for (const std::size_t columns : {0U, 1U, 2U}) {
        const Json row = Json::parse(row_of(std::vector<double>(columns, 0.25)).dump());
        EXPECT_EQ(row["columns"], columns);
        EXPECT_TRUE(row["noise"][0].is_null()) << columns;
        EXPECT_TRUE(row["snr_db"][0].is_null()) << columns;
    }
    EXPECT_TRUE(Json::parse(row_of({0.25, 0.25, 0.25}).dump())["snr_db"][0].is_null()) << "equal columns have no noise";
}

TEST(LevelMeter, NoiseIsThatOfTheSecondDifferences) {
    const Json row = row_of({0.25, 0.25, 0.25 + 0x1p-10});
    EXPECT_NEAR(row["noise"][0].get<double>(), 0x1p-10 / std::sqrt(6), 1e-8);
    EXPECT_NEAR(row["snr_db"][0].get<double>(), 20 * std::log10(std::sqrt(6) * (256 + 1.0 / 3)), 0.01);
}

}  // namespace
}  // namespace tricoil::host
