#include <gtest/gtest.h>

#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

const Json kValues = {{"name", "a {b}"},
                      {"poses", 12},
                      {"largest", std::int64_t{-3}},
                      {"rms_m", 0.0123456},
                      {"angle_rad", 0.5},
                      {"latency_us", {{"median", 1.5}, {"max", 7}}},
                      {"rejected", {{"stale", 2}, {"late", 40}}},
                      {"list", {1.0, 2.5}}};

TEST(JsonText, FillsKeysWithFormats) {
    EXPECT_EQ(fill(kValues, "{name}|{poses:>4}|{largest}|{rms_m:.3f}|"), "a {b}|  12|-3|0.012|");
    EXPECT_EQ(fill(kValues, "no key"), "no key");
    EXPECT_EQ(fill(kValues, ""), "");
}

TEST(JsonText, FollowsPathsIntoObjectsAndLists) {
    EXPECT_EQ(fill(kValues, "{latency_us/median:.1f} {latency_us/max} {list/1:.2f}"), "1.5 7 2.50");
}

TEST(JsonText, ConvertsUnits) {
    EXPECT_EQ(fill(kValues, "{rms_m in mm:.2f} {rms_m in %:.3f}"), "12.35 1.235");
    EXPECT_EQ(fill(kValues, "{angle_rad in deg:.3f} {poses in mm:.0f}"), "28.648 12000");
}

TEST(JsonText, ShowsNoSmallNumberAsZero) {
    const Json small{{"rms_m", 2.34e-7}, {"angle_deg", -4.5e-6}, {"none", 0.0}, {"large", 5e-4}};
    EXPECT_EQ(fill(small, "{rms_m in mm:.3f} {angle_deg:.4f} {none:.3f} {large in mm:.3f}"), "0.00023 -4.5e-06 0.000 0.500");
    EXPECT_EQ(fill(small, "{rms_m in mm:>12.3f}"), "     0.00023");
}

TEST(JsonText, AddsTheCountsOfAnObject) { EXPECT_EQ(fill(kValues, "{rejected} rejected"), "42 rejected"); }

TEST(JsonText, RefusesMistakesInTheText) {
    EXPECT_THROW(fill(kValues, "{pose}"), std::exception);
    EXPECT_THROW(fill(kValues, "{rms_m in inch}"), std::exception);
    EXPECT_THROW(fill(kValues, "{name:.3f}"), std::exception);
    EXPECT_THROW(fill(kValues, "{name in mm}"), std::exception);
    EXPECT_THROW(fill(kValues, "{list/7}"), std::exception);
}

}  // namespace
}  // namespace tricoil::host
