// Hemisphere: initial setting, then continuity; after a loss it is kept only if the sensor cannot have crossed the boundary.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/honesty/return_after_loss.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/squared_sigmas.hpp"

namespace tricoil::tracking {
namespace {

struct Seen {
    std::size_t valid_before = 0;
    std::size_t valid_after = 0;
    std::size_t wrong = 0;  // valid poses with an error above 5 cm
    std::size_t unknown_after = 0;
};

/// Plays four seconds with no columns in [gap_begin, gap_end).
template <typename Tracker>
Seen play(const sim::Motion& motion, double gap_begin_s, double gap_end_s, Tracker tracker) {
    Seen seen;
    test::replay<double>(motion, {true, 1e-6, 1, 0, 4}, [&](const Column<double>& column) {
        const double t = to_seconds(column.midpoint);
        const bool gap = t >= gap_begin_s && t < gap_end_s;
        const auto e = gap ? tracker.tick(column.midpoint) : tracker.update(column);
        if (!e || gap) {
            return;
        }
        const bool after = t >= gap_end_s;
        seen.unknown_after += after && e->flags.has(PoseFlag::hemisphere_unknown) ? 1U : 0U;
        if (e->valid()) {
            ++(after ? seen.valid_after : seen.valid_before);
            seen.wrong += (e->position_m - motion.at(t).position_m).norm() > 0.05 ? 1U : 0U;
        }
    });
    return seen;
}

void expect_unknown_after(const Seen& seen) {
    EXPECT_GT(seen.valid_before, 500U);
    EXPECT_EQ(seen.wrong, 0U);
    EXPECT_EQ(seen.valid_after, 0U);
    EXPECT_GT(seen.unknown_after, 500U);
}

TEST(AfterLoss, TheInitialSettingIsNotUsedAgain) {
    expect_unknown_after(play(test::walked_behind(), 1.5, 2.7, test::scaat_filter<double>(test::scaat_params<double>(true))));
    expect_unknown_after(play(test::walked_behind(), 1.5, 2.7, test::direct_tracker<double>(true, true)));
}

TEST(AfterLoss, MovedThroughTheBoundaryMeanwhile) {
    const test::Path path = test::moved({0.5, 0, 0.05}, {-0.3, 0.4, 0.05}, 1, 1.5);
    expect_unknown_after(play(path, 1, 1.5, test::scaat_filter<double>(test::scaat_params<double>(true))));
    expect_unknown_after(play(path, 1, 1.5, test::direct_tracker<double>(true, true)));
}

TEST(AfterLoss, TooShortToHaveCrossedItStaysKnown) {
    const test::Path path = test::moved({0.5, 0, 0.05}, {0.5, 0.2, 0.05}, 1, 1.2);
    for (const Seen& seen : {play(path, 1, 1.2, test::scaat_filter<double>(test::scaat_params<double>(true))),
                             play(path, 1, 1.2, test::direct_tracker<double>(true, true))}) {
        EXPECT_EQ(seen.wrong, 0U);
        EXPECT_GT(seen.valid_after, 1900U);
    }
}

/// 70 degrees away after 0.3 s: 0.86 m, while the mirror image is 1.23 m away.
TEST(AfterLoss, AHandMayHaveMovedFarButNotToTheMirrorImage) {
    constexpr double kAngle_rad = 70 * std::numbers::pi / 180;
    const Vec3<double> last(0.75, 0, 0);
    const Vec3<double> next(0.75 * std::cos(kAngle_rad), 0.75 * std::sin(kAngle_rad), 0);
    EXPECT_TRUE(Sides<double>::is_mirror_excluded(next, last, Microseconds{300'000}));
    EXPECT_FALSE(Sides<double>::is_mirror_excluded(next, last, Microseconds{250'000}));  // farther than a hand moves
    EXPECT_FALSE(Sides<double>::is_mirror_excluded(next, last, Microseconds{450'000}));  // both can be reached
}

TEST(AfterLoss, AVaguePoseDoesNotMakeAGuessKnown) {
    const Vec3<double> last(0.5, 0, 0);
    const auto at = [](double seconds) { return DeviceTime{microseconds_from_seconds(seconds)}; };
    Hemisphere<double> hemisphere(Vec3<double>::UnitX(), false);
    ASSERT_FALSE(hemisphere.must_mirror(last, at(0)));
    hemisphere.follow(last, at(0));
    ASSERT_FALSE(hemisphere.must_mirror(last, at(0.1)));
    EXPECT_TRUE(hemisphere.known());
    ASSERT_FALSE(hemisphere.must_mirror(last, at(1)));  // long enough to reach the mirror image
    EXPECT_FALSE(hemisphere.known());
    hemisphere.see(last, at(1));
    ASSERT_FALSE(hemisphere.must_mirror(last, at(1.01)));
    EXPECT_FALSE(hemisphere.known());
}

/// Short form of tests/honesty/return_test.cpp.
TEST(AfterLoss, ComesBackAtOnceAndOnItsSide) {
    constexpr int kRuns = 3;
    for (const bool is_tdm : {true, false}) {
        for (int method = 0; method < 3; ++method) {
            for (const double loss_s : {0.01, 0.05, 0.3}) {
                EXPECT_EQ(test::return_row({is_tdm, method, loss_s}, kRuns).late, 0);
            }
            EXPECT_EQ(test::return_row({is_tdm, method, 0.5, true}, kRuns).wrong, 0);
        }
    }
}

/// A jump by 100 degrees around the source: the mirror image is nearer.
TEST(Jump, AcrossTheBoundaryMakesTheHemisphereUnknown) {
    const test::Path path = test::moved({0.5, 0, 0.05}, {-0.1, 0.5, 0.05}, 1, 1.001);
    expect_unknown_after(play(path, 1.001, 1.001, test::scaat_filter<double>(test::scaat_params<double>(true))));
    expect_unknown_after(play(path, 1.001, 1.001, test::direct_tracker<double>(true, true)));
}

/// Setting the hemisphere during motion: accelerations are mirrored too, so that innovations do not increase.
TEST(SetHemisphere, MirrorsTheWholeMotion) {
    std::array<double, 2> worst{};
    for (const bool flip : {false, true}) {
        for (std::uint64_t seed = 1; seed <= 10; ++seed) {
            const auto motion = test::hand_like(seed);
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(true, Vec3<double>(flip ? -1 : 1, 0, 0)));
            bool told = false;
            test::replay<double>(motion, {true, test::sigma_for_cost(0.05e-3), seed, 0, 2.05}, [&](const Column<double>& c) {
                if (to_seconds(c.midpoint) > 2 && !told) {
                    const Vec3<double> before = filter.motion().acceleration_m_s2;
                    told = filter.set_hemisphere(Vec3<double>::UnitX()).ok();
                    EXPECT_EQ(filter.motion().acceleration_m_s2, flip ? Vec3<double>(-before) : before);
                }
                const auto e = filter.update(c);
                if (e && told) {
                    const Vec3<double> d = e->position_m - motion.at(to_seconds(c.midpoint)).position_m;
                    worst[flip ? 1 : 0] =
                        std::max(worst[flip ? 1 : 0], std::sqrt(test::squared_sigmas(d, e->covariance.topLeftCorner<3, 3>())));
                }
            });
        }
    }
    EXPECT_LT(worst[1], 1.01 * worst[0]);
}

}  // namespace
}  // namespace tricoil::tracking
