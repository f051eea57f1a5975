// Errors of the calibration that it states: poses are honest in every method and both number types.
#include <gtest/gtest.h>

#include "core/tracking/matrix/previous_tracker.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::test {
namespace {

constexpr int kSeeds = 40;
constexpr double kDeviation = 0.01;  // of C

/// Normal deviates with a mean square of one.
std::vector<double> deviates() {
    std::mt19937_64 random(4);
    std::normal_distribution<double> normal(0, 1);
    std::vector<double> values;
    double squares = 0;
    for (int k = 0; k < kSeeds; ++k) {
        values.push_back(normal(random));
        squares += values.back() * values.back() / kSeeds;
    }
    for (double& value : values) {
        value /= std::sqrt(squares);
    }
    return values;
}

template <typename Scalar>
calibration::Calibration<Scalar> coils_of(double constant, double stated) {
    calibration::Calibration<double> coils;
    coils.model = field::GeneralDipole<double>::concentric(constant);
    coils.errors.coupling_constant = stated;
    return coils.cast<Scalar>();
}

template <typename Scalar, typename Tracker>
Tracker tracker_of(const tracking::TrackerParams<Scalar>& params, const calibration::Calibration<Scalar>& coils) {
    if constexpr (std::is_same_v<Tracker, tracking::GeneralTracker<Scalar>>) {
        return Tracker(params, coils);
    } else {
        return Tracker(params, calibration::CoilCorrection<Scalar>::ideal_triads(coils).value());
    }
}

/// Poses of hands with a C that is wrong by another error in each.
template <typename Scalar, typename Tracker>
Score poses(bool tdm, const tracking::MethodParams<Scalar>& method, double stated) {
    Score score;
    const auto errors = deviates();
    for (int seed = 0; seed < kSeeds; ++seed) {
        const HandLike hand(static_cast<std::uint64_t>(seed) + 1);
        const auto params = replay_params<Scalar>(tdm, method, hand.at(0).position_m);
        auto tracker = tracker_of<Scalar, Tracker>(
            params, coils_of<Scalar>(kCoupling * (1 + kDeviation * errors[static_cast<std::size_t>(seed)]), stated));
        const ReplayParams replayed{tdm, sigma_for_cost(5e-4), static_cast<std::uint64_t>(seed), 0, 1.5};
        score.add(play<Scalar>(hand, replayed, tracker));
    }
    return score;
}

template <typename Scalar, typename Tracker>
void expect_honest(const char* name, bool tdm, const tracking::MethodParams<Scalar>& method) {
    const Score without = poses<Scalar, Tracker>(tdm, method, 0);
    const Score with = poses<Scalar, Tracker>(tdm, method, kDeviation);
    std::printf("%s %s: %.0f poses, %.3f mm RMS, NEES %.2f (not stated: %.2f), beyond 5 sigma %.3f %% (%.1f %%)\n", name,
                tdm ? "TDM" : "FDM", with.count(), 1e3 * with.position().rms, with.nees_position_per_dof(),
                without.nees_position_per_dof(), 100 * static_cast<double>(with.beyond_5_sigma) / with.count(),
                100 * static_cast<double>(without.beyond_5_sigma) / without.count());
    EXPECT_GT(with.nees_position_per_dof(), 0.8) << name;
    EXPECT_LT(with.nees_position_per_dof(), 1.2) << name;
    EXPECT_LT(static_cast<double>(with.beyond_5_sigma), 0.001 * with.count()) << name;
    EXPECT_GT(static_cast<double>(without.beyond_5_sigma), 0.05 * without.count()) << name << ": does not see the error";
    EXPECT_EQ(with.invalid, without.invalid) << name;
    EXPECT_EQ(with.position().rms, without.position().rms) << name;
}

TEST(CoilErrors, OnePercentOfTheCouplingConstantGivesHonestPoses) {
    for (const bool tdm : {true, false}) {
        expect_honest<double, tracking::DirectTracker<double>>("direct", tdm, tracking::DirectParams{tdm});
        expect_honest<double, tracking::PreviousTracker<double>>("previous", tdm, tracking::PreviousParams{2, tdm});
        expect_honest<double, tracking::ScaatTracker<double>>("scaat", tdm, tracking::ScaatParams<double>{});
        expect_honest<double, tracking::GeneralTracker<double>>("general", tdm, tracking::ScaatParams<double>{});
        expect_honest<float, tracking::DirectTracker<float>>("direct, float", tdm, tracking::DirectParams{tdm});
        expect_honest<float, tracking::ScaatTracker<float>>("scaat, float", tdm, tracking::ScaatParams<float>{});
    }
    expect_honest<double, tracking::DualBandTracker>("dual-band", false, tracking::DualBandParams{});
}

/// An error that alone exceeds the limit makes every pose uncertain, without loss of the sensor.
TEST(CoilErrors, ALargeOneMakesPosesUncertain) {
    const HandLike hand(1);
    const auto params = direct_params<double>(false, false, hand.at(0).position_m);
    auto limited = params;
    limited.common.max_deviation_m = 0.02;
    tracking::DirectTracker<double> tracker(
        limited, calibration::CoilCorrection<double>::ideal_triads(coils_of<double>(kCoupling, 0.3)).value());
    const Score score = play<double>(hand, {false, sigma_for_cost(1e-4), 1, 0, 1}, tracker);
    EXPECT_EQ(score.count(), 0);
    EXPECT_TRUE(score.flags.has(tracking::PoseFlag::uncertain));
    EXPECT_EQ(tracker.state(), tracking::TrackerState::tracking);
}

}  // namespace
}  // namespace tricoil::test
