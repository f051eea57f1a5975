// Health of a measurement: shares, worst values, warnings and their limits.
#include "board/support/link_health.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace tricoil::host {
namespace {

using ::testing::HasSubstr;

/// 100 updates per second with ten columns each; `missing_per_1000` of 1,000 columns are lost.
class Health : public ::testing::Test {
protected:
    void run(double duration_s, std::uint64_t missing_per_1000) {
        for (int n = 0; n < static_cast<int>(100 * duration_s); ++n) {
            due_ += 10 * missing_per_1000;
            counts_.lost += due_ / 1000;
            counts_.received += 10 - due_ / 1000;
            due_ %= 1000;
            now_ += Microseconds{10'000};
            passed_ += monitor_.update(counts_, now_) ? 1 : 0;
        }
    }
    [[nodiscard]] const LinkHealth& health() const { return monitor_.health(); }

    HealthMonitor monitor_;
    HealthCounts counts_;
    Microseconds now_;
    std::uint64_t due_ = 0;
    int passed_ = 0;
};

TEST_F(Health, WarnsWhileTooManyColumnsAreMissing) {
    run(3, 5);
    EXPECT_TRUE(health().warnings.empty()) << "half a per cent";
    EXPECT_NEAR(health().missing_share, 0.005, 0.001);
    run(2.1, 30);
    EXPECT_TRUE(health().warnings.has(HealthWarning::missing));
    run(2.1, 0);
    EXPECT_TRUE(health().warnings.empty());
    EXPECT_TRUE(health().seen_warnings.has(HealthWarning::missing));
    EXPECT_NEAR(health().worst_missing_share, 0.03, 0.005);
    EXPECT_THAT(health_line(health_json(health())),
                HasSubstr("warnings: more than 1 % of the columns are missing; worst second 3"));
    EXPECT_THAT(health_line(health_json(health()), pose_warning(30, 40, "distorted")),
                HasSubstr("columns are missing; 75 % of the poses are distorted; worst second 3"));
    EXPECT_EQ(pose_warning(1, 100, "invalid"), "");
    EXPECT_EQ(pose_warning(0, 0, "invalid"), "");
}

TEST_F(Health, RefusedColumnsAreMissingToo) {
    run(1, 0);
    counts_.refused += 50;
    run(1.1, 0);
    EXPECT_NEAR(health().worst_missing_share, 0.05, 0.005);
}

TEST_F(Health, WarnsOfAgeQueueAndTemperature) {
    counts_.age = Microseconds{200'000};
    counts_.queued_bytes = 1'000'000;
    counts_.temperature_c = 81;
    run(0.1, 0);
    EXPECT_EQ(health().warnings, (HealthWarnings{HealthWarning::late, HealthWarning::queue, HealthWarning::hot}));
    counts_.age = {};
    counts_.queued_bytes = 0;
    counts_.temperature_c = 79;
    run(0.1, 0);
    EXPECT_TRUE(health().warnings.empty());
    EXPECT_EQ(health().worst_age, Microseconds{200'000});
    EXPECT_EQ(health().most_queued_bytes, 1'000'000U);
}

TEST_F(Health, ADroppedLineIsAWarningForTwoSeconds) {
    counts_.dropped = 1;
    run(1.9, 0);
    EXPECT_TRUE(health().warnings.has(HealthWarning::queue));
    run(0.3, 0);
    EXPECT_TRUE(health().warnings.empty());
}

TEST_F(Health, IsReportedFiveTimesPerSecond) {
    run(10, 0);
    EXPECT_GE(passed_, 49);
    EXPECT_LE(passed_, 51);
}

TEST_F(Health, JsonHasEveryNumber) {
    run(1.5, 100);
    const auto json = health_json(health());
    EXPECT_EQ(json["lost"], health().counts.lost);
    EXPECT_EQ(json["received"], health().counts.received);
    EXPECT_TRUE(json["temperature_c"].is_null());
    EXPECT_NEAR(json["missing_percent"].get<double>(), 10, 1);
    EXPECT_EQ(json["warning"], "more than 1 % of the columns are missing");
    counts_.temperature_c = 20.5;
    run(0.1, 100);
    EXPECT_EQ(health_json(health())["temperature_c"], 20.5);
}

}  // namespace
}  // namespace tricoil::host
