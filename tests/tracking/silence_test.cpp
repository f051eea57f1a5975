// Missing coils, outliers and steps of every size: valid poses must agree with their covariance.
#include <gtest/gtest.h>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"
#include "tests/support/tally.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

using test::Tally;

enum class Silence { dropped, not_a_number };

/// The columns of one coil are missing from 2 s to 5 s of a hand motion; then the hemisphere is set again.
Tally unheard(int coil, Silence how, bool tdm, std::uint64_t seed, bool& valid_at_end) {
    const auto motion = test::hand_like(seed);
    const double sigma = test::sigma_for_cost(0.2e-3);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(tdm));
    Tally tally;
    bool told = false;
    test::replay<double>(motion, {tdm, sigma, seed, 0, 6}, [&](Column<double> column) {
        const double t = to_seconds(column.midpoint);
        std::optional<PoseEstimate<double>> e;
        if (t >= 2 && t < 5 && coil_index(column.state) == coil) {
            if (how == Silence::dropped) {
                e = tdm ? filter.tick(column.midpoint) : std::nullopt;
            } else {
                column.in_phase(0) = kNaN;
                e = filter.update(column);
            }
        } else {
            if (t >= 5.1 && !told) {
                told = filter.set_hemisphere(Vec3<double>::UnitX()).ok();
            }
            e = filter.update(column);
        }
        if (e && t > 0.5) {
            tally.add(*e, motion, 2);
            valid_at_end = e->valid();
        }
    });
    return tally;
}

TEST(MissingCoil, MakesThePoseStaleUntilItReturns) {
    for (const Silence how : {Silence::dropped, Silence::not_a_number}) {
        for (const bool tdm : {true, false}) {
            Tally all;
            for (int coil = 0; coil < kSourceCoils; ++coil) {
                for (std::uint64_t seed = 1; seed <= 3; ++seed) {
                    bool valid_at_end = false;
                    const Tally one = unheard(coil, how, tdm, seed, valid_at_end);
                    EXPECT_LT(one.first_flag_s, 0.05);
                    EXPECT_TRUE(valid_at_end);
                    all.add(one);
                }
            }
            all.print(tdm ? "tdm" : "fdm");
            EXPECT_LE(static_cast<double>(all.beyond_5_sigma), 1e-3 * static_cast<double>(all.valid));
        }
    }
}

/// A third of all simultaneous columns is lost: each frame still gives a pose with a consistent covariance.
TEST(Frames, WithoutAColumnAreUsed) {
    const auto motion = test::hand_like(2);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(false));
    std::mt19937_64 random(3);
    Tally tally;
    test::replay<double>(motion, {false, test::sigma_for_cost(0.05e-3), 1, 0, 10}, [&](const Column<double>& column) {
        const double t = to_seconds(column.midpoint);
        if (t > 2 && random() % 3 == 0) {
            return;
        }
        if (const auto e = filter.update(column); e && t > 2) {
            tally.add(*e, motion, 2);
        }
    });
    tally.print("a third of the columns lost");
    EXPECT_GT(tally.poses, 1800U);  // of 1,920; frames without any column give no pose
    EXPECT_GT(tally.valid, 1000U);
    EXPECT_LT(tally.longest_silence_s, 0.02);
    EXPECT_LE(static_cast<double>(tally.beyond_5_sigma), 1e-3 * static_cast<double>(tally.valid));
}

/// Outliers in one column of 20, 100 or 500, from 5 sigma up to the size of the coupling.
TEST(Outliers, OfEverySizeAndRateAreHonest) {
    for (const unsigned every : {20U, 100U, 500U}) {
        for (const double size : {1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2}) {
            Tally tally;
            for (std::uint64_t seed = 1; seed <= 3; ++seed) {
                const auto motion = test::hand_like(seed);
                auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
                std::mt19937_64 random(seed + 77);
                std::normal_distribution<double> normal(0, 1);
                test::replay<double>(motion, {true, test::sigma_for_cost(0.2e-3), seed, 0, 6}, [&](Column<double> c) {
                    if (to_seconds(c.midpoint) > 2 && random() % every == 0) {
                        c.in_phase += size * Vec3<double>(normal(random), normal(random), normal(random));
                    }
                    const auto e = filter.update(c);
                    if (e && to_seconds(c.midpoint) > 0.5) {
                        tally.add(*e, motion, 2);
                    }
                });
            }
            tally.print((std::to_string(every) + ", " + std::to_string(size)).c_str());
            EXPECT_LE(static_cast<double>(tally.beyond_5_sigma), 1e-3 * static_cast<double>(tally.valid)) << every << ' ' << size;
            EXPECT_GT(tally.valid, tally.poses / 2);
        }
    }
}

/// Jumps of 1 mm to 20 cm: from the second column after a jump, no pose at or near the old position is valid. (The first column
/// may be of the coil that is least sensitive to the jump.)
TEST(Steps, OfEverySizeAreHonest) {
    for (const double step_m : {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2}) {
        Tally tally;
        std::size_t valid_at_end = 0;
        for (int run = 0; run < 60; ++run) {
            sim::Pose before{{0.5, 0, 0}, geometry::rotation_vector_to_quaternion<double>({0.3, -0.2, 0.6})};
            sim::Pose after = before;
            after.position_m += step_m * Vec3<double>(0.6, 0.64, 0.48);  // a direction in which all coils are sensitive
            const double jump_s = 0.5 + run % 3 / test::kSlotsPerSecond;
            const test::StepMotion motion(before, after, jump_s - 1e-4);
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
            Tally one;
            bool valid = false;
            test::replay<double>(motion,
                                 {true, test::sigma_for_snr(60, 0.5), static_cast<std::uint64_t>(run + 1), 0, jump_s + 0.2},
                                 [&](const Column<double>& c) {
                                     const auto e = filter.update(c);
                                     if (e && to_seconds(c.midpoint) > jump_s + 1e-3) {
                                         one.add(*e, motion, jump_s);
                                         valid = e->valid();
                                     }
                                 });
            tally.add(one);
            valid_at_end += valid ? 1U : 0U;
        }
        tally.print((std::to_string(1e3 * step_m) + " mm").c_str());
        EXPECT_LE(static_cast<double>(tally.beyond_5_sigma), 1e-3 * static_cast<double>(tally.valid)) << step_m;
        EXPECT_EQ(valid_at_end, 60U);
    }
}

}  // namespace
}  // namespace tricoil::tracking
