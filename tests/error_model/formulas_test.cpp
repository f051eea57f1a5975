// The paper's formulas against the exact expressions that they approximate; properties stated in the paper.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/error_model/accumulated_error.hpp"
#include "core/error_model/board_timing.hpp"
#include "core/error_model/cartesian_error.hpp"
#include "core/error_model/increment_error.hpp"
#include "core/error_model/singularity.hpp"
#include "tests/error_model/azimuth_increment_error.hpp"
#include "tests/support/approx.hpp"

namespace tricoil::error_model {
namespace {

using Step = LineOfSightStep<double>;

TEST(Kappa, ExactIsThreeCosineSquaredMinusOne) {
    const Step step{0.4, 0.3, -0.2};
    const auto u = geometry::direction(0.3, 0.2);
    const auto u_hat = geometry::direction(0.0, 0.4);
    EXPECT_NEAR(kappa_exact(step), 3 * std::pow(u.dot(u_hat), 2) - 1, 1e-15);
}

TEST(Kappa, PaperFormIsExactForPureElevation) {
    const Step step{0.4, 0.0, 0.13};
    EXPECT_NEAR(kappa_paper(step), kappa_exact(step), 1e-15);
}

TEST(Kappa, ErrorOfThePaperFormIsOfThirdOrder) {
    // Differences start at the third order, through sin(2 beta) d_beta d_alpha^2.
    const auto off = [](double size) {
        const Step step{0.7, size, size};
        return std::abs(kappa_paper(step) - kappa_exact(step));
    };
    EXPECT_NEAR(off(0.02) / off(0.01), 8, 0.5);
}

TEST(Limits38, AllErrorsVanishWithTheUpdateTime) {
    const double alpha_rate = 25;
    const double beta_rate = -14;
    double last = 1e9;
    for (const double update_s : {1e-2, 1e-3, 1e-4, 1e-5}) {
        const Step step{0.5, alpha_rate * update_s, beta_rate * update_s};
        for (const KappaForm form : {KappaForm::exact, KappaForm::paper, KappaForm::two}) {
            EXPECT_LT(std::abs(range_error(1.0, kappa(form, step))), 2e3 * update_s * update_s);
            EXPECT_LT(std::abs(elevation_increment_error(form, step)), 1e3 * update_s * update_s);
            EXPECT_LT(std::abs(azimuth_increment_error(form, step, 0.0)), 1e3 * update_s * update_s);
        }
        const double now = std::abs(elevation_increment_error(KappaForm::exact, step));
        EXPECT_LT(now, last);
        last = now;
    }
}

/// (29), (28) and (33) term by term, at steps for which no term is small.
TEST(PaperForm, IsEquations28And29And33AsPrinted) {
    for (const Step& step : {Step{0.3, 0.1, 0.07}, Step{-0.9, 0.4, -0.3}, Step{1.2, -0.2, 0.35}}) {
        const double b = step.elevation_rad;
        const double da = step.d_azimuth_rad;
        const double db = step.d_elevation_rad;
        const double kappa_29 =
            2 - 3 * std::pow(std::sin(db), 2) - 3 * std::pow(std::cos(b), 2) * std::cos(2 * db) * std::pow(std::sin(da), 2);
        EXPECT_NEAR(kappa(KappaForm::paper, step), kappa_29, 1e-15);
        const double elevation_28 =
            db - (2 / kappa_29) * (std::sin(2 * db) * std::cos(da) / 2 + std::sin(2 * b) * std::pow(std::sin(da), 2) / 4);
        EXPECT_NEAR(elevation_increment_error(KappaForm::paper, step), elevation_28, 1e-15);
        const double azimuth_33 = da - (2 / kappa_29) * std::sin(da) * std::cos(db) * std::cos(b) / std::cos(b - 0.05);
        EXPECT_NEAR(azimuth_increment_error(KappaForm::paper, step, 0.05), azimuth_33, 1e-15);
    }
    // Independently computed numbers, so that the test does not depend only on the formulas above.
    EXPECT_NEAR(kappa(KappaForm::paper, Step{0.3, 0.1, 0.07}), 1.958302099867667, 1e-15);
    EXPECT_NEAR(elevation_increment_error(KappaForm::paper, Step{0.3, 0.1, 0.07}), -0.0023380700629357792, 1e-15);
    EXPECT_NEAR(azimuth_increment_error(KappaForm::paper, Step{0.3, 0.1, 0.07}, 0.05), -0.0002843562900388258, 1e-15);
}

TEST(IncrementErrors, KappaTwoIsEquation32AsPrinted) {
    const Step step{0.3, 0.1, 0.07};
    const double printed = 0.07 - std::sin(0.14) * std::cos(0.1) / 2 - std::sin(0.6) * std::pow(std::sin(0.1), 2) / 4;
    EXPECT_NEAR(elevation_increment_error(KappaForm::two, step), printed, 1e-16);
}

TEST(IncrementErrors, KappaTwoIsEquation36AsPrinted) {
    const Step step{0.3, 0.1, 0.07};
    const double printed = 0.1 - std::sin(0.1) * std::cos(0.07) * std::cos(0.3) / std::cos(0.3 - 0.05);
    EXPECT_NEAR(azimuth_increment_error(KappaForm::two, step, 0.05), printed, 1e-16);
}

/// Closed loop, one axis: d~ = sin(2d) / (2 - 3 sin^2 d), error -(5/6) d^3.
TEST(ClosedLoop, OneAxisConvergesCubically) {
    for (const double d : {0.2, 0.1, 0.05, 0.025}) {
        const double error = elevation_increment_error(KappaForm::exact, Step{0.0, 0.0, d});
        EXPECT_NEAR(error, d - std::sin(2 * d) / (2 - 3 * std::pow(std::sin(d), 2)), 1e-15);
        EXPECT_NEAR(error / (d * d * d), -5.0 / 6, 2 * d * d);
    }
}

/// Remark 3.
TEST(AccumulatedError, AnglesDoNotDependOnTheRange) {
    for (const Loop loop : {Loop::open, Loop::closed}) {
        AccumulatedError<double> near(KappaForm::exact, loop, {0.2, 0, 0});
        AccumulatedError<double> far(KappaForm::exact, loop, {2.0, 0, 0});
        for (int n = 1; n < 100; ++n) {
            near.update({0.2, 0.03 * n, 0.005 * n});
            far.update({2.0 + 0.01 * n, 0.03 * n, 0.005 * n});
            EXPECT_EQ(near.error().azimuth_rad, far.error().azimuth_rad);
            EXPECT_EQ(near.error().elevation_rad, far.error().elevation_rad);
        }
        EXPECT_NE(near.error().range_m, far.error().range_m);
    }
}

TEST(AccumulatedError, ElevationErrorPropagatesIntoTheAzimuth) {
    const Step step{1.2, 0.05, 0.0};
    const double without = measured_azimuth_increment(KappaForm::exact, step, 1.2);
    const double with = measured_azimuth_increment(KappaForm::exact, step, 1.2 - 0.1);
    EXPECT_NEAR(with / without, std::cos(1.2) / std::cos(1.1), 1e-12);
}

TEST(Singularity, FindsTheInstantBetweenTwoUpdates) {
    SingularityDetector<double> detector(1.5, device_time_us(1'000));
    const double pole = std::numbers::pi / 2;
    const auto passage = detector.update(1.5 + 2 * (pole - 1.5), device_time_us(2'000));
    ASSERT_TRUE(passage);
    EXPECT_NEAR(static_cast<double>(to_us(*passage)), 1'500, 1);
    EXPECT_FALSE(detector.update(1.7, device_time_us(3'000)));
    EXPECT_TRUE(detector.update(1.5, device_time_us(4'000))) << "downwards through the same pole";
    EXPECT_FALSE(detector.update(-1.5, device_time_us(5'000)));
    EXPECT_TRUE(detector.update(-1.6, device_time_us(6'000))) << "the other pole";
}

TEST(Singularity, FindsOddQuarterTurnsOnly) {
    SingularityDetector<double> detector(0.0, DeviceTime{});
    int passages = 0;
    for (int n = 1; n <= 1'000; ++n) {
        passages += detector.update(0.01 * n, device_time_us(n)) ? 1 : 0;
    }
    EXPECT_EQ(passages, 3);  // 10 rad: pi/2, 3 pi/2, 5 pi/2
}

/// P^T (e_rho, rho cos(beta) e_alpha, -rho e_beta). Positive elevation points to -z.
Vec3<double> cartesian_error_first_order(const geometry::Spherical<double>& real, const geometry::Spherical<double>& error) {
    const Vec3<double> along_axes(error.range_m, real.range_m * std::cos(real.elevation_rad) * error.azimuth_rad,
                                  -real.range_m * error.elevation_rad);
    return geometry::line_of_sight_rotation(real.azimuth_rad, real.elevation_rad).transpose() * along_axes;
}

TEST(CartesianError, FirstOrderAgreesForSmallErrors) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int n = 0; n < 100; ++n) {
        const geometry::Spherical<double> real{1 + unit(random) / 2, 3 * unit(random), 1.4 * unit(random)};
        const geometry::Spherical<double> error{1e-5 * unit(random), 1e-5 * unit(random), 1e-5 * unit(random)};
        const Vec3<double> exact = cartesian_error(real, error);
        EXPECT_LT((exact - cartesian_error_first_order(real, error)).norm(), 1e-9);
        EXPECT_GT(exact.norm(), 1e-8);
    }
}

TEST(BoardTiming, AgesFollowTheOrderOfTheStates) {
    const double slot = 1.0 / 720;
    EXPECT_TRUE(is_approx(tdm_timing(slot, 1e-3, LastState::s3).column_age_s, slot * Vec3<double>(2, 1, 0)));
    EXPECT_TRUE(is_approx(tdm_timing(slot, 1e-3, LastState::s1).column_age_s, slot * Vec3<double>(0, 2, 1)));
    EXPECT_TRUE(is_approx(tdm_timing(slot, 1e-3, LastState::s2).column_age_s, slot * Vec3<double>(1, 0, 2)));
}

/// Remark 4: gaps lengthen the turn per update, and the closed-loop error with its cube.
TEST(BoardTiming, ErrorGrowsWithTheCubeOfTheUpdateTime) {
    const double rate = 10;
    const double update_s = 1.0 / 240;
    const double longer_s = update_s + 0.0015;
    const auto error = [&](double t) { return elevation_increment_error(KappaForm::exact, Step{0.0, 0.0, rate * t}); };
    EXPECT_NEAR(error(longer_s) / error(update_s), std::pow(longer_s / update_s, 3), 0.02);
}

}  // namespace
}  // namespace tricoil::error_model
