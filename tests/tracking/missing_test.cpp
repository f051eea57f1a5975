// Poses after lost or refused columns have the flag columns_missing.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

/// Numbers of the columns, counted from 0, whose poses are flagged, if `change` is applied to column 300.
template <typename Tracker, typename Change>
std::vector<int> flagged_columns(Tracker tracker, bool tdm, Change change) {
    std::vector<int> found;
    int n = 0;
    test::ReplayParams params;
    params.tdm = tdm;
    params.sigma = 1e-6;
    test::replay<double>(test::hand_like(3), params, [&](Column<double> column) {
        if (n == 300) {
            change(column);
        }
        const auto estimate = tracker.update(column);
        if (estimate && estimate->flags.has(PoseFlag::columns_missing)) {
            EXPECT_TRUE(estimate->valid()) << "a warning only";
            found.push_back(n);
        }
        ++n;
    });
    return found;
}

constexpr auto kRefuse = [](Column<double>& c) { c.in_phase(1) = std::numeric_limits<double>::quiet_NaN(); };
constexpr auto kFollowGap = [](Column<double>& c) { c.flags.set(ColumnFlag::after_gap); };
constexpr auto kNothing = [](Column<double>&) {};

TEST(Missing, TheNextTwoMatricesAreFlagged) {
    const auto filter = [] { return test::scaat_filter<double>(test::scaat_params<double>(true)); };
    EXPECT_EQ(flagged_columns(filter(), true, kNothing), std::vector<int>{});
    EXPECT_EQ(flagged_columns(filter(), true, kFollowGap), (std::vector<int>{300, 301, 302, 303, 304, 305}));
    EXPECT_EQ(flagged_columns(filter(), true, kRefuse), (std::vector<int>{301, 302, 303, 304, 305, 306}));
}

TEST(Missing, AlsoByTheDirectMethodInBothModes) {
    EXPECT_EQ(flagged_columns(test::direct_tracker<double>(true, true), true, kNothing), std::vector<int>{});
    EXPECT_EQ(flagged_columns(test::direct_tracker<double>(true, true), true, kFollowGap),
              (std::vector<int>{300, 301, 302, 303, 304, 305}));
    EXPECT_EQ(flagged_columns(test::direct_tracker<double>(false, false), false, kFollowGap), (std::vector<int>{302, 305}));
    EXPECT_EQ(flagged_columns(test::direct_tracker<double>(false, false), false, kRefuse), (std::vector<int>{305}))
        << "the frame of the refused column has no pose";
}

TEST(Missing, NotAfterAColumnThatComesTwice) {
    auto tracker = test::direct_tracker<double>(true, true);
    test::ReplayParams params;
    params.tdm = true;
    params.sigma = 1e-6;
    test::replay<double>(test::hand_like(3), params, [&](const Column<double>& column) {
        for (const bool again : {false, true}) {
            const auto estimate = tracker.update(column);
            EXPECT_FALSE(estimate && estimate->flags.has(PoseFlag::columns_missing)) << again;
        }
    });
    EXPECT_GT(tracker.counters().rejected[static_cast<std::size_t>(Rejection::duplicate)], 100U);
}

}  // namespace
}  // namespace tricoil::tracking
