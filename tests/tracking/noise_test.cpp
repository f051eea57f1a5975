// Wrong sigmas, and sigmas that differ between channels.
#include <gtest/gtest.h>

#include "core/tracking/matrix/previous_tracker.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/deviation_score.hpp"
#include "tests/support/hand_like.hpp"
#include "tests/support/tally.hpp"

namespace tricoil::tracking {
namespace {

struct Stated {
    test::Tally tally;
    std::size_t inconsistent = 0;
};

/// Columns with `factor` times their stated noise.
Stated play_understated(const sim::Motion& motion, bool tdm, double factor, std::uint64_t seed) {
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(tdm));
    Stated stated;
    test::replay<double>(motion, {tdm, test::sigma_for_cost(0.05e-3), seed, 0, 6}, [&](Column<double> column) {
        column.sigma /= factor;
        if (const auto e = filter.update(column); e && to_seconds(column.midpoint) > 0.5) {
            stated.tally.add(*e, motion, 0);
            stated.inconsistent += e->flags.has(PoseFlag::inconsistent) ? 1U : 0U;
        }
    });
    return stated;
}

/// The motion model could interpret excess noise as motion: the covariance must grow, or the pose must be flagged.
TEST(UnderstatedNoise, IsNoticed) {
    for (const bool tdm : {true, false}) {
        for (const double factor : {1.0, 2.0, 3.0, 5.0, 10.0}) {
            Stated all;
            for (std::uint64_t seed = 1; seed <= 3; ++seed) {
                const auto hand = test::hand_like(seed);
                const sim::StillMotion still(hand.at(0));
                for (const sim::Motion* motion :
                     {static_cast<const sim::Motion*>(&hand), static_cast<const sim::Motion*>(&still)}) {
                    const Stated one = play_understated(*motion, tdm, factor, seed);
                    all.tally.add(one.tally);
                    all.inconsistent += one.inconsistent;
                }
            }
            all.tally.print((std::string(tdm ? "tdm" : "fdm") + ", stated sigma over " + std::to_string(factor)).c_str());
            const double flagged = static_cast<double>(all.inconsistent) / static_cast<double>(all.tally.poses);
            if (factor < 3) {
                EXPECT_LE(static_cast<double>(all.tally.beyond_5_sigma), 1e-3 * static_cast<double>(all.tally.valid)) << factor;
                EXPECT_LT(flagged, 1e-3) << factor;
            } else {
                EXPECT_GT(flagged, 0.98) << factor;
                EXPECT_LE(static_cast<double>(all.tally.beyond_5_sigma), 2e-3 * static_cast<double>(all.tally.poses)) << factor;
            }
        }
    }
}

template <typename Tracker>
void expect_covered(const char* name, bool tdm, const MethodParams<double>& method) {
    for (const double factor : {1.0, 3.0, 10.0}) {
        test::Score score;
        for (std::uint64_t seed = 1; seed <= 4; ++seed) {
            const auto hand = test::hand_like(seed);
            const double sigma = test::sigma_for_cost(0.3e-3);
            Tracker tracker(test::replay_params<double>(tdm, method, Vec3<double>::UnitX()));
            test::replay<double>(hand, {tdm, sigma, seed, 0, 4}, [&](Column<double> column) {
                column.sigma /= factor;
                if (const auto e = tracker.update(column)) {
                    score.add(*e, hand, sigma);
                }
            });
        }
        std::printf("%s %s, stated sigma over %2.0f: NEES %.2f, %zu of %.0f poses beyond 5 sigma\n", name, tdm ? "tdm" : "fdm",
                    factor, score.nees_position_per_dof(), score.beyond_5_sigma, score.count());
        EXPECT_LT(score.nees_position_per_dof(), 1.4) << name << factor;
        EXPECT_GT(score.nees_position_per_dof(), 0.6) << name << factor << ": taken for metal";
        EXPECT_LE(static_cast<double>(score.beyond_5_sigma), 3e-3 * score.count()) << name << factor;
    }
}

TEST(UnderstatedNoise, IsCoveredByMethodsWithoutAFilter) {
    for (const bool tdm : {true, false}) {
        expect_covered<DirectTracker<double>>("direct", tdm, DirectParams{tdm});
        expect_covered<PreviousTracker<double>>("previous", tdm, PreviousParams{2, tdm});
    }
}

/// The outliers that sound noise contains by chance hardly widen the covariance.
TEST(StatedDeviation, OfTheFilterIsItsError) {
    for (const bool tdm : {true, false}) {
        std::vector<double> ratios;
        for (std::uint64_t seed = 1; seed <= 21; ++seed) {
            const auto hand = test::hand_like(seed);
            const test::ReplayParams params{tdm, test::sigma_for_cost(0.5e-3), seed, 0, 5};
            ratios.push_back(test::score_predictions<double>(hand, params, Microseconds{0}).ratio());
        }
        std::sort(ratios.begin(), ratios.end());
        std::printf("%s: stated deviation over error %.2f, %.2f to %.2f\n", tdm ? "tdm" : "fdm", ratios[10], ratios.front(),
                    ratios.back());
        EXPECT_GT(ratios[10], 0.9);
        EXPECT_LT(ratios[10], 1.12);
        EXPECT_GT(ratios.front(), 0.75);
        EXPECT_LT(ratios.back(), 1.35);
    }
}

/// One noisy channel among good ones, all sigmas correct: the good channels must not be linearised at a pose dominated by the
/// noisy one.
TEST(UnevenNoise, OfOneSensorChannelIsWeighed) {
    for (const double factor : {10.0, 100.0, 300.0}) {
        test::Tally tally;
        for (std::uint64_t seed = 1; seed <= 3; ++seed) {
            const auto motion = test::hand_like(seed);
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(false));
            std::mt19937_64 random(seed);
            std::normal_distribution<double> normal(0, 1);
            const double sigma = test::sigma_for_cost(0.05e-3);
            test::replay<double>(motion, {false, sigma, seed, 0, 6}, [&](Column<double> column) {
                column.in_phase(1) += factor * sigma * normal(random);
                column.sigma(1) = std::hypot(1.0, factor) * sigma;
                if (const auto e = filter.update(column); e && to_seconds(column.midpoint) > 0.5) {
                    tally.add(*e, motion, 0);
                }
            });
        }
        tally.print(("one channel times " + std::to_string(factor)).c_str());
        EXPECT_LE(static_cast<double>(tally.beyond_5_sigma), 1e-3 * static_cast<double>(tally.valid)) << factor;
        EXPECT_GT(tally.valid, tally.poses / 2) << factor;
    }
}

}  // namespace
}  // namespace tricoil::tracking
