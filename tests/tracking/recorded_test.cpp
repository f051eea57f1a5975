// Error ratios of the trackers on all recorded hand motions. Skipped without the data.
#include <gtest/gtest.h>

#include "tests/support/deviation_score.hpp"
#include "tests/support/hand_like.hpp"
#include "tests/support/prediction_score.hpp"
#include "tests/support/recordings.hpp"

namespace tricoil::tracking {
namespace {

struct Totals {
    test::Score naive;
    test::Score deskewed;
    test::Score filtered;
    double least_gain = 1e9;  // naive over filtered position RMS, per file
    double least_nees = 1e9;
    double most_nees = 0;
    std::uint64_t reacquisitions = 0;  // of the filter
};

class Recorded : public ::testing::Test {
protected:
    void SetUp() override {
        files_ = test::recorded_motion_files();
        if (files_.empty()) {
            GTEST_SKIP() << "no recorded hand motions: set TRICOIL_DATA_DIR to a folder with hand-motion/";
        }
    }

    /// speed: factor on the speed of the hands.
    Totals play_all(double sigma, double speed = 1) const {
        Totals totals;
        std::uint64_t seed = 0;
        for (const auto& file : files_) {
            const auto recorded = test::recorded_motion(file);
            const test::ScaledTime motion(*recorded, speed);
            const test::ReplayParams params{true, sigma, ++seed, 0, recorded->duration_s() / speed};
            const Vec3<double> start = motion.at(0).position_m;
            auto naive = test::direct_tracker<double>(true, false, start);
            auto deskewed = test::direct_tracker<double>(true, true, start);
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(true, start));
            const auto naive_score = test::play<double>(motion, params, naive);
            totals.naive.add(naive_score);
            totals.deskewed.add(test::play<double>(motion, params, deskewed));
            const auto score = test::play<double>(motion, params, filter);
            totals.filtered.add(score);
            totals.least_gain = std::min(totals.least_gain, naive_score.position().rms / score.position().rms);
            totals.reacquisitions += filter.counters().reacquisitions;
            for (const double nees : {score.nees_position_per_dof(), score.nees_rotation_per_dof()}) {
                totals.least_nees = std::min(totals.least_nees, nees);
                totals.most_nees = std::max(totals.most_nees, nees);
            }
        }
        return totals;
    }

    std::vector<std::string> files_;
};

TEST_F(Recorded, WithoutNoise) {
    const auto t = play_all(0);
    const double naive = t.naive.position().rms;
    std::printf("naive %.3f mm, deskewed 1/%.1f, filtered 1/%.1f (1/%.1f or less in every file), orientation 1/%.1f\n",
                1e3 * naive, naive / t.deskewed.position().rms, naive / t.filtered.position().rms, t.least_gain,
                t.naive.orientation().rms / t.filtered.orientation().rms);
    EXPECT_GT(naive, 4e-3);
    EXPECT_LT(naive, 10e-3);
    EXPECT_GT(t.least_gain, 100);
    EXPECT_EQ(t.reacquisitions, 0U);
    EXPECT_GT(t.naive.orientation().rms / t.filtered.orientation().rms, 100);
    EXPECT_GT(naive / t.deskewed.position().rms, 12);
}

TEST_F(Recorded, WithLittleNoise) {
    const auto t = play_all(test::sigma_for_cost(0.05e-3));
    std::printf("naive / filtered %.2f, error^2 / covariance %.2f to %.2f\n", t.naive.position().rms / t.filtered.position().rms,
                t.least_nees, t.most_nees);
    EXPECT_GT(t.naive.position().rms / t.filtered.position().rms, 15);
    EXPECT_GT(t.least_nees, 0.5);  // the covariance contains misfit due to motion that the columns do not show (one file)
    EXPECT_LT(t.most_nees, 1.5);
    EXPECT_LE(static_cast<double>(t.filtered.beyond_5_sigma), 1e-3 * t.filtered.count());
}

TEST_F(Recorded, WithMuchNoise) {
    const auto t = play_all(test::sigma_for_cost(0.5e-3));
    std::printf("filtered / static bound %.3f, error^2 / covariance %.2f to %.2f\n",
                t.filtered.position().rms / t.filtered.static_bound_m(), t.least_nees, t.most_nees);
    EXPECT_LT(t.filtered.position().rms, 0.7 * t.filtered.static_bound_m());
    EXPECT_GT(t.least_nees, 0.5);
    EXPECT_LT(t.most_nees, 1.5);
    EXPECT_LE(static_cast<double>(t.filtered.beyond_5_sigma), 1e-3 * t.filtered.count());
}

/// Hands of up to 15 m/s and 200 m/s^2.
TEST_F(Recorded, ThreeTimesTheSpeedIsNotLost) {
    for (const double sigma : {0.0, test::sigma_for_cost(0.05e-3)}) {
        const auto t = play_all(sigma, 3);
        std::printf("sigma %.1e: filtered %.3f mm, %zu of %.0f beyond 5 sigma, %zu invalid, %lu reacquisitions\n", sigma,
                    1e3 * t.filtered.position().rms, t.filtered.beyond_5_sigma, t.filtered.count(), t.filtered.invalid,
                    static_cast<unsigned long>(t.reacquisitions));
        EXPECT_EQ(t.reacquisitions, 0U);
        EXPECT_LE(static_cast<double>(t.filtered.beyond_5_sigma), 1e-3 * t.filtered.count());
        EXPECT_LT(static_cast<double>(t.filtered.invalid), 0.03 * t.filtered.count());
    }
}

TEST_F(Recorded, PredictionBeatsHolding) {
    test::Score predicted;
    test::Score held;
    for (const auto& file : files_) {
        const auto motion = test::recorded_motion(file);
        auto params = test::scaat_params<double>(true, motion->at(0).position_m);
        std::get<ScaatParams<double>>(params.method).predict_ahead = Microseconds{20'000};
        auto filter = test::scaat_filter<double>(params);
        const double duration_s = motion->duration_s() - 0.03;  // the truth must extend over the prediction time
        test::replay<double>(*motion, {true, 0, 1, 0, duration_s}, [&](const Column<double>& column) {
            if (const auto e = filter.update(column)) {
                predicted.add(*e, *motion, 0);
                auto last = *e;
                last.position_m = filter.motion().position_m;
                last.q_source_sensor = filter.motion().q_source_sensor;
                held.add(last, *motion, 0);
            }
        });
    }
    std::printf("20 ms ahead: %.3f mm, held %.3f mm (%.1f times)\n", 1e3 * predicted.position().rms, 1e3 * held.position().rms,
                held.position().rms / predicted.position().rms);
    EXPECT_GT(held.position().rms / predicted.position().rms, 3);
    EXPECT_GT(held.orientation().rms / predicted.orientation().rms, 3);
}

/// Hands and fast motions (up to 5 m/s): stated over actual error, and no pose becomes invalid because it is predicted.
TEST_F(Recorded, PredictionsStateTheirDeviation) {
    std::vector<std::unique_ptr<sim::RecordedMotion>> hands;
    std::vector<std::unique_ptr<sim::RecordedMotion>> fast;
    for (const auto& file : files_) {
        hands.push_back(test::recorded_motion(file));
    }
    for (const auto& file : test::recorded_files("fast-motion", ".csv")) {
        fast.push_back(test::fast_motion(file));
    }
    for (const auto* motions : {&hands, &fast}) {
        for (const bool tdm : {true, false}) {
            const auto play_all = [&](int ahead_ms) {
                test::DeviationScore all;
                for (std::size_t n = 0; n < motions->size(); ++n) {
                    const auto& motion = *(*motions)[n];
                    const test::ReplayParams params{tdm, test::sigma_for_cost(0.05e-3), n + 1, 0, motion.duration_s()};
                    all.add(test::score_predictions<double>(motion, params, Microseconds{1000 * ahead_ms}));
                }
                return all;
            };
            if (motions->empty()) {
                continue;  // the folder has no fast motions
            }
            const auto measured = play_all(0);
            for (const int ahead_ms : {5, 10, 20, 50, 100}) {
                const auto score = play_all(ahead_ms);
                std::printf("%s, %s, %3d ms ahead: %.3f mm, stated / actual: position %.2f, rotation %.2f; %zu invalid (%zu)\n",
                            motions == &hands ? "hands" : "fast", tdm ? "TDM" : "FDM", ahead_ms, 1e3 * score.rms_m(),
                            score.ratio(), score.rotation_ratio(), score.invalid, measured.invalid);
                EXPECT_GT(score.ratio(), 0.8);
                EXPECT_LT(score.ratio(), 1.3);
                EXPECT_GT(score.rotation_ratio(), 0.8);
                EXPECT_LT(score.rotation_ratio(), 1.3);
                EXPECT_LE(score.invalid, measured.invalid);
            }
        }
    }
}

/// Stated over actual RMS of each hand with the noise of `tricoil run`. By chance alone, for the RMS of each pose over many
/// seeds, 2.0 % of the hands in TDM and 0.6 % in FDM are outside 0.75 to 1.35; with seeds 1 to 20 the filter has 1.6 % and 0.8 %.
TEST_F(Recorded, EveryHandStatesItsError) {
    constexpr std::uint64_t kSeeds = 4;
    for (const bool tdm : {true, false}) {
        std::vector<double> ratios;
        std::size_t outside = 0;
        for (const auto& file : files_) {
            const auto motion = test::recorded_motion(file);
            for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
                const test::ReplayParams params{tdm, tdm ? 9.167e-7 : 1.0225e-6, seed, 0, motion->duration_s()};
                ratios.push_back(test::score_predictions<double>(*motion, params, Microseconds{0}).ratio());
                outside += ratios.back() < 0.75 || ratios.back() > 1.35 ? 1U : 0U;
            }
        }
        std::sort(ratios.begin(), ratios.end());
        const double median = ratios[ratios.size() / 2];
        std::printf("%s: stated / actual %.2f to %.2f, median %.3f; %zu of %zu outside 0.75 to 1.35\n", tdm ? "TDM" : "FDM",
                    ratios.front(), ratios.back(), median, outside, ratios.size());
        EXPECT_GT(median, 0.9);
        EXPECT_LT(median, 1.15);
        EXPECT_LE(outside, ratios.size() * (tdm ? 3 : 2) / 100);
    }
}

/// At an error of the filter of about 0.1 mm, a prediction costs at most a fifth more than one with the true velocity.
TEST_F(Recorded, PredictionIsAlmostAsGoodAsTheTrueVelocity) {
    for (const bool tdm : {true, false}) {
        test::PredictionScore score;
        std::uint64_t seed = 0;
        for (const auto& file : files_) {
            const auto motion = test::recorded_motion(file);
            test::add_predictions(*motion, {tdm, test::sigma_for_cost(0.01e-3), ++seed, 0, motion->duration_s()}, score);
        }
        for (std::size_t n = 0; n < test::PredictionScore::kAhead_s.size(); ++n) {
            std::printf("%s, %2.0f ms ahead: %.3f mm, ratio %.3f\n", tdm ? "TDM" : "FDM",
                        1e3 * test::PredictionScore::kAhead_s[n], 1e3 * score.predicted_rms_m(n), score.ratio(n));
            EXPECT_LT(score.ratio(n), 1.2);
        }
    }
}

}  // namespace
}  // namespace tricoil::tracking
