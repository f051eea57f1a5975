// Filter with coils 45 mm apart: with the correct model it is as accurate as with ideal coils, and the couplings determine the
// hemisphere.
#include <gtest/gtest.h>

#include "core/tracking/methods/any_tracker.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

/// Source coils 45 mm apart, axes 3 degrees from orthogonal; sensor coils 6 mm from their centre.
field::GeneralDipole<double> wide_triad() {
    auto coils = field::GeneralDipole<double>::concentric(test::kCoupling);
    const double d = 0.045 / std::sqrt(2.0);
    coils.source_offset_m.diagonal().setConstant(d);
    coils.source_offset_m -= Mat3<double>::Constant(d / 3);
    coils.sensor_offset_m.diagonal().setConstant(0.006);
    const double slant = std::sin(3 * 3.14159265358979 / 180);
    coils.source_moment(0, 1) = slant * test::kCoupling;
    coils.source_moment(2, 0) = -slant * test::kCoupling;
    return coils;
}

calibration::Calibration<double> known_wide_triad() {
    calibration::Calibration<double> known;
    known.model = wide_triad();
    return known;
}

/// Columns as from test::replay, with the couplings of wide_triad().
template <typename Take>
void replay_wide(const sim::Motion& motion, const test::ReplayParams& params, Take&& take) {
    const auto coils = wide_triad();
    std::mt19937_64 random(params.seed);
    std::normal_distribution<double> normal(0, 1);
    test::ReplayParams silent = params;
    silent.sigma = 0;
    test::replay<double>(motion, silent, [&](Column<double> column) {
        const auto truth = motion.at(to_seconds(column.midpoint));
        const auto o = geometry::attitude_matrix(truth.q_source_sensor);
        column.in_phase = field::column_model(coils, truth.position_m, o, coil_index(column.state)).column;
        column.in_phase += params.sigma * Vec3<double>(normal(random), normal(random), normal(random));
        column.sigma.setConstant(std::max(params.sigma, test::kSigmaFloor));
        take(column);
    });
}

test::Score play_wide(const sim::Motion& motion, const test::ReplayParams& params, Tracker<double>& filter) {
    test::Score score;
    replay_wide(motion, params, [&](const Column<double>& column) {
        if (const auto e = filter.update(column)) {
            score.add(*e, motion, params.sigma);
        }
    });
    return score;
}

TEST(WideTriad, TracksMotionInTurn) {
    test::Score wide;
    test::Score ideal;
    test::Score wrong;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        const auto motion = test::hand_like(seed);
        const test::ReplayParams params{true, test::sigma_for_cost(0.05e-3), seed, 0, 5};
        GeneralTracker<double> filter(test::scaat_params<double>(true), known_wide_triad());
        wide.add(play_wide(motion, params, filter));
        EXPECT_EQ(filter.counters().reacquisitions, 0U);
        auto concentric = test::scaat_filter<double>(test::scaat_params<double>(true));
        ideal.add(test::play<double>(motion, params, concentric));
        auto misled = test::scaat_filter<double>(test::scaat_params<double>(true));
        replay_wide(motion, params, [&](const Column<double>& column) {
            if (const auto e = misled.update(column)) {
                wrong.add(*e, motion, params.sigma);
            }
        });
    }
    std::printf("45 mm triad %.4f mm, ideal triad %.4f mm; concentric model on the 45 mm triad: %zu valid poses, %zu invalid\n",
                1e3 * wide.position().rms, 1e3 * ideal.position().rms, wrong.position_m.size(), wrong.invalid);
    EXPECT_LT(wide.position().rms, 1.1 * ideal.position().rms);
    EXPECT_EQ(wide.invalid, 0U);
    EXPECT_GT(wide.nees_position_per_dof(), 0.5);
    EXPECT_LT(wide.nees_position_per_dof(), 1.5);
}

TEST(WideTriad, TracksFrames) {
    const auto motion = test::hand_like(4);
    GeneralTracker<double> filter(test::scaat_params<double>(false), known_wide_triad());
    const auto score = play_wide(motion, {false, test::sigma_for_cost(0.05e-3), 1, 0, 5}, filter);
    EXPECT_LT(score.position().rms, 0.2e-3);
    EXPECT_EQ(score.invalid, 0U);
}

/// Without a setting, or with a wrong one: coils 45 mm apart determine the hemisphere at about 0.75 m, from the first pose on.
TEST(WideTriad, DeterminesTheHemisphere) {
    for (const Vec3<double>& setting : {Vec3<double>(0, 0, 0), Vec3<double>(-1, 0, 0)}) {
        for (std::uint64_t seed = 1; seed <= 10; ++seed) {
            const auto motion = test::hand_like(seed);
            GeneralTracker<double> filter(test::scaat_params<double>(true, setting), known_wide_triad());
            const auto score = play_wide(motion, {true, test::sigma_for_cost(0.05e-3), seed, 0, 1}, filter);
            EXPECT_EQ(score.invalid, 0U) << score.flags.bits();
            EXPECT_LT(score.position().max, 5e-3);
        }
    }
}

/// AnyTracker corrects the phases of the channels from the calibration: equal results with phase errors as without them.
TEST(WideTriad, IsTrackedByItsCalibration) {
    const auto motion = test::hand_like(5);
    const test::ReplayParams params{true, test::sigma_for_cost(0.05e-3), 5, 0, 3};
    const double phase = 0.3;
    auto known = known_wide_triad();
    known.phase_rad.setConstant(phase);
    GeneralTracker<double> filter(test::scaat_params<double>(true), known_wide_triad());
    AnyTracker tracker(test::scaat_params<double>(true), known);
    double worst = 0;
    std::size_t poses = 0;
    replay_wide(motion, params, [&](const Column<double>& column) {
        Column<double> turned = column;
        turned.in_phase = std::cos(phase) * column.in_phase - std::sin(phase) * column.quadrature;
        turned.quadrature = std::sin(phase) * column.in_phase + std::cos(phase) * column.quadrature;
        const auto expected = filter.update(column);
        const auto got = tracker.update(turned);
        ASSERT_EQ(expected.has_value(), got.has_value());
        if (got) {
            ++poses;
            worst = std::max(worst, (got->position_m - expected->position_m).norm());
        }
    });
    EXPECT_GT(poses, 2000U);
    EXPECT_LT(worst, 1e-9);
}

TEST(WideTriad, NeedsTheFilter) {
    EXPECT_EQ(AnyTracker::check({}, known_wide_triad()).code(), StatusCode::invalid_argument);
    EXPECT_TRUE(AnyTracker::check({{}, ScaatParams<double>{}}, known_wide_triad()).ok());
}

/// The output correction is applied to the pose and its covariance.
TEST(WideTriad, PosesAreCorrectedAsTheCalibrationSays) {
    const auto motion = test::hand_like(6);
    const test::ReplayParams params{true, test::sigma_for_cost(0.05e-3), 6, 0, 1};
    auto known = known_wide_triad();
    known.output_linear(0, 1) = 0.02;
    known.output_linear(2, 2) = 1.01;
    known.output_offset_m = {0.001, -0.002, 0.003};
    AnyTracker plain(test::scaat_params<double>(true), known_wide_triad());
    AnyTracker corrected(test::scaat_params<double>(true), known);
    replay_wide(motion, params, [&](const Column<double>& column) {
        const auto before = plain.update(column);
        const auto after = corrected.update(column);
        if (before && after) {
            const Vec3<double> expected = known.output_linear * before->position_m + known.output_offset_m;
            ASSERT_LT((after->position_m - expected).norm(), 1e-12);
            const Mat3<double> covariance = before->covariance.topLeftCorner<3, 3>();
            const Mat3<double> spread = known.output_linear * covariance * known.output_linear.transpose();
            ASSERT_TRUE((is_approx(after->covariance.topLeftCorner<3, 3>(), spread, 1e-9)));
        }
    });
}

}  // namespace
}  // namespace tricoil::tracking
