// Faults: flags within 50 ms, consistent covariance of valid poses, recovery.
#include <gtest/gtest.h>

#include <functional>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kBegin_s = 2;
constexpr double kEnd_s = 3;

struct FaultRun {
    double first_flag_s = 1e9;   // after the beginning of the fault
    double valid_again_s = 1e9;  // after the end of the fault
    std::size_t valid = 0;
    std::size_t beyond_5_sigma = 0;  // valid poses beyond 5 sigma
    std::size_t lost_poses = 0;
    PoseFlags flags;
};

/// Replays a hand motion through a filter. During the second of the fault `spoil` changes columns, or drops them by returning
/// false.
FaultRun play_fault(const std::function<bool(Column<double>&)>& spoil, std::uint64_t seed = 2) {
    const auto motion = test::hand_like(seed);
    const double sigma = test::sigma_for_cost(0.2e-3);
    auto params = test::scaat_params<double>(true);
    params.common.confined = true;  // in a second without columns the sensor can cross the boundary
    auto filter = test::scaat_filter<double>(params);
    FaultRun run;
    test::Score all;
    test::replay<double>(motion, {true, sigma, seed, 0, 5}, [&](const Column<double>& good) {
        Column<double> column = good;
        const double t = to_seconds(good.midpoint);
        const bool faulty = t >= kBegin_s && t < kEnd_s;
        const bool arrives = !faulty || spoil(column);
        const auto e = arrives ? filter.update(column) : filter.tick(good.midpoint);
        if (!e) {
            return;
        }
        all.add(*e, motion, sigma);
        PoseFlags notable = e->flags;
        if (faulty) {
            run.flags |= notable;
            if (!e->valid() || e->flags.has(PoseFlag::coasting)) {
                run.first_flag_s = std::min(run.first_flag_s, t - kBegin_s);
            }
        } else if (t >= kEnd_s && e->valid()) {
            run.valid_again_s = std::min(run.valid_again_s, t - kEnd_s);
        }
    });
    run.valid = all.position_m.size();
    run.beyond_5_sigma = all.beyond_5_sigma;
    run.lost_poses = all.invalid;
    EXPECT_EQ(filter.state(), TrackerState::tracking);
    return run;
}

void expect_honest(const FaultRun& run) {
    EXPECT_LT(run.first_flag_s, 0.05);
    EXPECT_LT(run.valid_again_s, 0.05);
    EXPECT_LE(static_cast<double>(run.beyond_5_sigma), 1e-3 * static_cast<double>(run.valid));
    EXPECT_GT(run.valid, 2000U);
}

TEST(Fault, Dropout) {
    const auto run = play_fault([](auto&) { return false; });
    expect_honest(run);
    EXPECT_TRUE(run.flags.has(PoseFlag::stale));
}

TEST(Fault, HalfOfTheColumnsDropped) {
    std::mt19937_64 random(5);
    const auto run = play_fault([&](auto&) { return random() % 2 == 0; });
    expect_honest(run);
    EXPECT_TRUE(run.flags.has(PoseFlag::coasting));
}

TEST(Fault, Outliers) {
    std::mt19937_64 random(6);
    std::normal_distribution<double> normal(0, 1);
    const auto run = play_fault([&](Column<double>& c) {
        if (random() % 20 == 0) {
            c.in_phase += 3e-3 * Vec3<double>(normal(random), normal(random), normal(random));
        }
        return true;
    });
    EXPECT_TRUE(run.flags.has(PoseFlag::unconfirmed));
    EXPECT_LE(static_cast<double>(run.beyond_5_sigma), 1e-3 * static_cast<double>(run.valid));
    EXPECT_LT(run.lost_poses, 200U);  // about 36 outliers in 720 columns, and poses after them
}

TEST(Fault, ReversedCoil) {
    for (int j = 0; j < 3; ++j) {
        const auto run = play_fault([&](Column<double>& c) {
            c.in_phase *= coil_index(c.state) == j ? -1 : 1;
            return true;
        });
        expect_honest(run);
        EXPECT_TRUE(run.flags.has(PoseFlag::wrong_handedness)) << j;
    }
}

TEST(Fault, ReversedSensorCoil) {
    for (int i = 0; i < 3; ++i) {
        const auto run = play_fault([&](Column<double>& c) {
            c.in_phase(i) *= -1;
            return true;
        });
        expect_honest(run);
        EXPECT_TRUE(run.flags.has(PoseFlag::wrong_handedness)) << i;
    }
}

TEST(Fault, OpenCoil) {
    for (int j = 0; j < 3; ++j) {
        const auto run = play_fault([&](Column<double>& c) {
            if (coil_index(c.state) == j) {
                c.in_phase.setZero();
                c.flags.set(ColumnFlag::no_reference);
            }
            return true;
        });
        expect_honest(run);
        EXPECT_TRUE(run.flags.has(PoseFlag::no_reference)) << j;
    }
}

TEST(Fault, OpenSensorCoil) {
    const auto run = play_fault([&](Column<double>& c) {
        c.in_phase(1) = 0;
        return true;
    });
    expect_honest(run);
}

TEST(Fault, Saturation) {
    const auto run = play_fault([&](Column<double>& c) {
        c.in_phase = c.in_phase.cwiseMin(5e-3).cwiseMax(-5e-3);
        c.flags.set(ColumnFlag::saturated);
        return true;
    });
    expect_honest(run);
    EXPECT_TRUE(run.flags.has(PoseFlag::saturated));
}

TEST(Fault, WrongWiringFromTheStartIsNeverTracked) {
    const auto motion = test::hand_like(2);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
    int flagged = 0;
    test::replay<double>(motion, {true, 1e-6, 1, 0, 1}, [&](Column<double> column) {
        column.in_phase(2) *= -1;
        if (const auto e = filter.update(column)) {
            EXPECT_FALSE(e->valid());
            flagged += e->flags.has(PoseFlag::wrong_handedness) ? 1 : 0;
        }
    });
    EXPECT_GT(flagged, 500);
    EXPECT_EQ(filter.counters().acquisitions, 0U);
}

TEST(Hemisphere, UnknownIsFlagged) {
    const auto motion = test::hand_like(2);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(true, Vec3<double>::Zero()));
    bool said = true;
    test::replay<double>(motion, {true, 1e-6, 1, 0, 1}, [&](const Column<double>& column) {
        const auto e = filter.update(column);
        said = said && (!e || (e->flags.has(PoseFlag::hemisphere_unknown) && !e->valid()));
    });
    EXPECT_TRUE(said);
    // Setting the hemisphere in motion mirrors position, velocity and covariance.
    ASSERT_TRUE(filter.set_hemisphere(Vec3<double>::UnitX()).ok());
    test::Score score;
    test::replay<double>(motion, {true, 1e-6, 2, 1.0, 1}, [&](const Column<double>& column) {
        if (const auto e = filter.update(column)) {
            score.add(*e, motion, 1e-6);
        }
    });
    EXPECT_LT(score.position().max, 5e-3);
    EXPECT_EQ(filter.counters().reacquisitions, 0U);
    EXPECT_EQ(filter.set_hemisphere(Vec3<double>::Constant(std::nan(""))).code(), StatusCode::not_finite);
}

}  // namespace
}  // namespace tricoil::tracking
