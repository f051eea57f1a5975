// Bias of the high band by metal, from couplings of two bands.
#include <gtest/gtest.h>

#include <random>

#include "core/field/general_dipole.hpp"
#include "core/tracking/metal/metal_bias.hpp"
#include "tests/support/two_bands.hpp"

namespace tricoil::tracking {
namespace {

/// What metal adds, relative to its in-phase effect on the high band.
struct Ratios {
    double low = 0;
    double low_quadrature = 0;
    double high_quadrature = 0;
};

/// A resting sensor at 0.5 m beside a sphere.
class Bench {
public:
    Bench(double share, double effect) : Bench(Ratios{share}, effect) {}
    Bench(const Ratios& ratios, double effect, double low_noise = 1e-5)
        : ratios_(ratios), effect_(effect), low_noise_(low_noise) {
        pose_.position_m = {0.4, 0.2, 0.2};
        pose_.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(Vec3<double>(0.3, -0.5, 0.7));
    }

    void run(MetalBias& bias, int frames) {
        for (int n = 0; n < frames; ++n) {
            const auto model = field::GeneralDipole<double>::concentric(test::kDualBandCoupling);
            const Mat3<double> clean = field::signal_matrix<double>(model, pose_.position_m, attitude());
            const Mat3<double> metal = effect_ * test::two_bands_detail::through_sphere(model, pose_, {0.2, -0.1, 0.15});
            const Mat3<double> high = clean + metal + noise(1e-6);
            high_ = solver::minimise<double>(model, high, Mat3<double>(Mat3<double>::Ones()), pose_)->pose;
            bias.add_high({high, ratios_.high_quadrature * metal + noise(1e-6)}, high_);
            bias.add_low({clean + ratios_.low * metal + noise(low_noise_), ratios_.low_quadrature * metal + noise(low_noise_)},
                         low_noise_);
        }
    }

    [[nodiscard]] Vec3<double> true_bias() const { return high_.position_m - pose_.position_m; }

    void set_effect(double effect) { effect_ = effect; }

private:
    [[nodiscard]] Mat3<double> attitude() const { return pose_.q_source_sensor.conjugate().toRotationMatrix(); }
    Mat3<double> noise(double sigma) {
        return sigma * Mat3<double>::NullaryExpr([this] { return normal_(random_); });
    }

    Ratios ratios_;
    double effect_;
    double low_noise_;
    solver::RigidPose<double> pose_;
    solver::RigidPose<double> high_;
    std::mt19937 random_{7};
    std::normal_distribution<double> normal_;
};

/// quadrature_floor: 1: unknown.
MetalBias make_bias(double quadrature_floor = 1) {
    CommonParams<double> params;
    params.coupling_constant = test::kDualBandCoupling;
    params.misfit_floor = 1e-6;
    params.quadrature_floor = quadrature_floor;
    return MetalBias(params, {});
}

TEST(MetalBias, IsThatOfTheHighBand) {
    for (const double share : {-0.1, 0.0, 0.3, 0.7, 1.6, 2.5}) {
        Bench bench(share, -1e-4);
        MetalBias bias = make_bias();
        bench.run(bias, 80);
        const auto estimate = bias.estimate();
        ASSERT_TRUE(estimate);
        const Vec3<double> error = estimate->position_m.value - bench.true_bias();
        EXPECT_GT(bench.true_bias().norm(), 3e-3);
        EXPECT_LT(error.norm(), 0.25 * bench.true_bias().norm()) << share;
        EXPECT_LT(error.norm(), 4 * estimate->position_m.sigma) << share;
        EXPECT_NEAR(bias.share().value(), share, 3 * bias.share().sigma()) << share;
        EXPECT_LT(bias.share().sigma(), 0.2 + 0.25 * std::abs(share));
    }
}

/// A sphere of 40 mm and 25 MS/m: ratios from its exact polarisability. They are equal in all couplings, so the share alone would
/// do as well; tests/honesty/dual_band_test.cpp has metal with unequal ones.
TEST(MetalBias, QuadraturesGiveIt) {
    const auto position_with = [](double quadrature_floor) {
        MetalBias bias = make_bias(quadrature_floor);
        Bench bench(Ratios{0.77, 0.251, 0.077}, -1e-4, 1e-6);
        bench.run(bias, 80);
        const Bias position = bias.estimate()->position_m;
        const double error_m = (position.value - bench.true_bias()).norm();
        EXPECT_LT(error_m, 0.1 * bench.true_bias().norm()) << quadrature_floor;
        EXPECT_LT(error_m, 4 * position.sigma) << quadrature_floor;
        return position.value;
    };
    EXPECT_NE(position_with(0), position_with(1));
}

TEST(MetalBias, IsZeroWithoutMetal) {
    Bench bench(0.3, 0);
    MetalBias bias = make_bias();
    int used = 0;
    for (int n = 0; n < 300; ++n) {
        bench.run(bias, 1);
        const auto estimate = bias.estimate();
        used += estimate && estimate->position_m.value.norm() > 0 ? 1 : 0;
        EXPECT_EQ(estimate.has_value(), n >= 23) << n;
    }
    EXPECT_LT(used, 15);  // chance
}

TEST(MetalBias, SuddenMetalStartsANewWindow) {
    Bench bench(0.1, 0);
    MetalBias bias = make_bias();
    bench.run(bias, 60);
    ASSERT_TRUE(bias.estimate());
    bench.set_effect(-1e-4);
    bench.run(bias, 1);
    EXPECT_FALSE(bias.estimate());
    bench.run(bias, 40);
    ASSERT_TRUE(bias.estimate());
    EXPECT_LT((bias.estimate()->position_m.value - bench.true_bias()).norm(), 0.2 * bench.true_bias().norm());
}

}  // namespace
}  // namespace tricoil::tracking
