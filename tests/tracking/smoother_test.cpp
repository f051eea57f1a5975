#include <gtest/gtest.h>

#include <iostream>

#include "board/host/smooth/smoothing_tap.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/recordings.hpp"

namespace tricoil::test {
namespace {

host::TrackerSettings settings_of(bool tdm, const Vec3<double>& hemisphere) {
    host::TrackerSettings settings;
    settings.tracker = scaat_params<double>(tdm, hemisphere);
    return settings;
}

struct Scores {
    Score filter;
    Score smoother;
};

/// Filter and smoother on the same columns. keep: false leaves a column out.
template <typename Keep>
Scores play_both(const sim::Motion& motion, const ReplayParams& params, Keep&& keep) {
    Scores scores;
    const host::TrackerSettings settings = settings_of(params.tdm, motion.at(0).position_m);
    tracking::AnyTracker filter(settings.tracker);
    host::SmoothingTap tap([&](const host::SmoothedPose& smoothed) { scores.smoother.add(smoothed.pose, motion, params.sigma); });
    tap.begin(settings);
    replay<double>(motion, params, [&](const Column<double>& column) {
        if (keep(column)) {
            if (const auto estimate = filter.update(column)) {
                scores.filter.add(*estimate, motion, params.sigma);
            }
            tap.column({column});
        }
    });
    tap.finish();
    return scores;
}

Scores play_both(const sim::Motion& motion, const ReplayParams& params) {
    return play_both(motion, params, [](const Column<double>&) { return true; });
}

void expect_better_and_honest(const Scores& scores) {
    EXPECT_LT(scores.smoother.position().rms, 0.7 * scores.filter.position().rms);
    EXPECT_LT(scores.smoother.orientation().rms, 0.7 * scores.filter.orientation().rms);
    for (const double nees : {scores.smoother.nees_position_per_dof(), scores.smoother.nees_rotation_per_dof()}) {
        EXPECT_GT(nees, 0.8);
        EXPECT_LT(nees, 1.25);
    }
}

TEST(Smoother, RecordedMotions) {
    const auto files = recorded_motion_files();
    if (files.empty()) {
        GTEST_SKIP() << "no recordings: set TRICOIL_DATA_DIR to a folder with hand-motion/";
    }
    for (const bool tdm : {true, false}) {
        Scores all;
        for (std::size_t n = 0; n < files.size(); n += 4) {
            const auto motion = recorded_motion(files[n]);
            ReplayParams params;
            params.tdm = tdm;
            params.sigma = sigma_for_cost(0.05e-3);
            params.seed = n + 1;
            params.duration_s = motion->duration_s();
            const Scores scores = play_both(*motion, params);
            all.filter.add(scores.filter);
            all.smoother.add(scores.smoother);
        }
        std::cout << (tdm ? "TDM" : "FDM") << ": " << 1e3 * all.smoother.position().rms << " mm, filter "
                  << 1e3 * all.filter.position().rms << " mm; NEES " << all.smoother.nees_position_per_dof() << ", "
                  << all.smoother.nees_rotation_per_dof() << '\n';
        expect_better_and_honest(all);
        EXPECT_LE(all.smoother.beyond_5_sigma, all.smoother.position_m.size() / 1000);
    }
}

/// A minute of TDM columns is longer than one piece: the border between pieces leaves no trace.
TEST(Smoother, SimulatedHand) {
    const sim::HandMotion motion({0.6, 0, 0}, 7);
    ReplayParams params;
    params.sigma = sigma_for_cost(0.05e-3);
    params.duration_s = 60;
    const Scores scores = play_both(motion, params);
    EXPECT_EQ(scores.smoother.position_m.size(), scores.filter.position_m.size());
    EXPECT_LT(scores.smoother.position().rms, 0.7 * scores.filter.position().rms);
    EXPECT_LT(scores.smoother.position().max, scores.filter.position().max);
}

/// Silence of half a second: the sensor is lost, and a new interval begins.
TEST(Smoother, AGapSeparatesIntervals) {
    const sim::HandMotion motion({0.6, 0, 0}, 3);
    ReplayParams params;
    params.sigma = sigma_for_cost(0.05e-3);
    params.duration_s = 4;
    const auto whole = play_both(motion, params);
    const auto gap = play_both(motion, params, [](const Column<double>& column) {
        const double time_s = to_seconds(column.midpoint);
        return time_s < 2 || time_s > 2.5;
    });
    EXPECT_LT(gap.smoother.position_m.size(), whole.smoother.position_m.size());
    EXPECT_LT(gap.smoother.position().max, 3 * whole.filter.position().max);
    EXPECT_EQ(gap.smoother.beyond_5_sigma, 0U);
}

TEST(Smoother, VelocityAndRateAreThoseOfTheMotion) {
    const sim::CircleMotion motion({0.5, 0, 0}, 0.1, 1);  // 0.628 m/s, 6.283 rad/s about z
    host::SmoothedPose last;
    host::SmoothingTap tap([&](const host::SmoothedPose& smoothed) {
        if (to_seconds(smoothed.pose.time) < 1) {
            last = smoothed;
        }
    });
    tap.begin(settings_of(true, {1, 0, 0}));
    ReplayParams params;
    params.sigma = sigma_for_cost(0.01e-3);
    params.duration_s = 2;
    replay<double>(motion, params, [&](const Column<double>& column) { tap.column({column}); });
    tap.finish();
    const double angle = 2 * std::numbers::pi * to_seconds(last.pose.time);
    const Vec3<double> velocity = 0.2 * std::numbers::pi * Vec3<double>(-std::sin(angle), std::cos(angle), 0);
    EXPECT_LT((last.velocity_m_s - velocity).norm(), 0.01);
    EXPECT_LT((last.rate_rad_s - Vec3<double>(0, 0, 2 * std::numbers::pi)).norm(), 0.1);
}

/// The poses of a filter with prediction have a later time than its columns.
TEST(Smoother, SettingsBecomeThoseOfAFilterWithoutPrediction) {
    host::TrackerSettings settings;
    settings.tracker.method = tracking::DirectParams{true};
    EXPECT_TRUE(std::holds_alternative<tracking::ScaatParams<double>>(host::for_smoothing(settings).tracker.method));
    tracking::ScaatParams<double> scaat;
    scaat.predict_ahead = Microseconds{20'000};
    scaat.gate = 25;
    settings.tracker.method = scaat;
    const auto changed = std::get<tracking::ScaatParams<double>>(host::for_smoothing(settings).tracker.method);
    EXPECT_EQ(changed.predict_ahead, Microseconds{0});
    EXPECT_EQ(changed.gate, 25);
    settings.tracker.method = tracking::DualBandParams{.filter = false, .predict_ahead = Microseconds{20'000}};
    const auto bands = std::get<tracking::DualBandParams>(host::for_smoothing(settings).tracker.method);
    EXPECT_TRUE(bands.filter);
    EXPECT_EQ(bands.predict_ahead, Microseconds{0});
}

}  // namespace
}  // namespace tricoil::test
