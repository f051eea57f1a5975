// Effect of exact spheres in the high band, from what both bands show of them.
#include "core/tracking/dual_band/metal_effect.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "core/geometry/rotations.hpp"
#include "sim/world/metal/body.hpp"
#include "sim/world/metal/sphere.hpp"

namespace tricoil::tracking {
namespace {

const std::vector<double> kTones_hz{480, 720, 960, 7680, 10080, 13440};
const Vec3<double> kSensor_m{0.5, 0, 0};
constexpr double kLowNoise = 3e-4;  // field of unit dipoles, 1/m^3
constexpr double kHighNoise = 3e-5;

struct Case {
    MetalEvidence evidence;
    Mat3<double> effect;
};

Eigen::Matrix<double, 3, 9> redundant_numbers() {  // line of sight along x
    Mat3<double> trace = Mat3<double>::Identity() / std::sqrt(3.0);
    Mat3<double> square = Mat3<double>::Zero();
    square(1, 1) = 1 / std::sqrt(2.0);
    square(2, 2) = -1 / std::sqrt(2.0);
    Mat3<double> diagonal = Mat3<double>::Zero();
    diagonal(1, 2) = diagonal(2, 1) = 1 / std::sqrt(2.0);
    Eigen::Matrix<double, 3, 9> rows;
    rows << trace.reshaped().transpose(), square.reshaped().transpose(), diagonal.reshaped().transpose();
    return rows;
}

/// strength: 0 for no metal.
Case observe(double radius_m, const sim::Material& material, const Vec3<double>& place_m, double strength, std::uint64_t seed) {
    sim::SphereBody body(sim::Sphere{radius_m}, material);
    body.tune(kTones_hz);
    body.place_source(-place_m);
    std::vector<sim::ComplexMat3> fields(6, sim::ComplexMat3::Zero());
    body.add_field(kSensor_m - place_m, fields);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto noise = [&](double sigma) { return Mat3<double>::NullaryExpr([&] { return sigma * normal(random); }).eval(); };
    Mat3<double> low = noise(kLowNoise);
    Case out{};
    MetalEvidence& evidence = out.evidence;
    evidence.predicted[1] = noise(kLowNoise);
    evidence.high_quadrature = noise(kHighNoise);
    for (Eigen::Index j = 0; j < 3; ++j) {
        const auto coil = static_cast<std::size_t>(j);
        out.effect.col(j) = strength * fields[coil + 3].col(j).real();
        low.col(j) += strength * fields[coil].col(j).real();
        evidence.predicted[1].col(j) += strength * fields[coil].col(j).imag();
        evidence.high_quadrature.col(j) += strength * fields[coil + 3].col(j).imag();
    }
    const Mat3<double> high = out.effect + noise(kHighNoise);
    evidence.predicted[0] = high - low;
    evidence.predicted[2] = evidence.high_quadrature;
    evidence.variance << kLowNoise * kLowNoise, kLowNoise * kLowNoise, kHighNoise * kHighNoise, kHighNoise * kHighNoise;
    evidence.redundant_of_effect = redundant_numbers();
    evidence.redundant = evidence.redundant_of_effect * high.reshaped();
    evidence.redundant_variance = kHighNoise * kHighNoise;
    return out;
}

struct Outcome {
    double remaining = 0;  // norm of the error relative to the effect, or to the difference of the bands if that is larger
    double worst = 0;      // largest error of an entry in standard deviations
};

Outcome estimate(const Case& seen) {
    static MetalEstimator estimator;
    const MetalEffect found = estimator.estimate(seen.evidence);
    const Mat3<double> error = found.mean - seen.effect;
    const Eigen::Matrix<double, 9, 1> sigma = found.covariance.diagonal().cwiseSqrt();
    return {error.norm() / std::max(seen.effect.norm(), seen.evidence.predicted[0].norm()),
            error.reshaped().cwiseAbs().cwiseQuotient(sigma).maxCoeff()};
}

sim::Material named(const std::string& name) {
    for (const sim::NamedMaterial& material : sim::materials()) {
        if (material.name == name) {
            return material.material;
        }
    }
    ADD_FAILURE() << name;
    return {};
}

TEST(MetalEstimator, SpheresOfAllMetalsLeaveASmallPartThatTheCovarianceContains) {
    const std::pair<const char*, double> limits[] = {{"titanium", 0.1},  {"304", 0.1}, {"copper", 0.5},
                                                     {"aluminium", 0.5}, {"416", 0.7}, {"steel", 0.7}};
    for (const auto& [name, limit] : limits) {
        for (const double radius_m : {0.015, 0.02, 0.03}) {
            const Outcome outcome = estimate(observe(radius_m, named(name), {0.2, 0.06, 0.03}, 1, 7));
            // The effect of steel of 30 mm in the high band is near zero: magnetisation and eddy currents cancel.
            std::printf("%s, radius %.0f mm: %.3f is left, at most %.1f standard deviations\n", name, 1e3 * radius_m,
                        outcome.remaining, outcome.worst);
            EXPECT_LT(outcome.remaining, limit) << name << ' ' << radius_m;
            EXPECT_LT(outcome.worst, 5) << name << ' ' << radius_m;
        }
    }
}

TEST(MetalEstimator, NoiseIsNotTakenForMetal) {
    MetalEstimator estimator;
    double square = 0;
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        const Case nothing = observe(0.02, named("aluminium"), {0.2, 0.06, 0.03}, 0, seed);
        square += estimator.estimate(nothing.evidence).mean.squaredNorm() / 9 / 50;
    }
    EXPECT_LT(std::sqrt(square), 0.3 * kHighNoise);
}

/// The evidence has no scale of its own: ten times the couplings with ten times the noise give ten times the effect.
TEST(MetalEstimator, IsIndependentOfTheUnitOfTheCouplings) {
    Case seen = observe(0.02, named("304"), {0.2, 0.06, 0.03}, 1, 3);
    MetalEstimator estimator;
    const MetalEffect before = estimator.estimate(seen.evidence);
    for (Mat3<double>& part : seen.evidence.predicted) {
        part *= 10;
    }
    seen.evidence.high_quadrature *= 10;
    seen.evidence.variance *= 100;
    seen.evidence.redundant *= 10;
    seen.evidence.redundant_variance *= 100;
    const MetalEffect after = estimator.estimate(seen.evidence);
    EXPECT_LT((after.mean - 10 * before.mean).norm(), 1e-6 * after.mean.norm());
    EXPECT_LT((after.covariance - 100 * before.covariance).norm(), 1e-6 * after.covariance.norm());
}

/// Where the predictions are old, the quadrature of the high band decides.
TEST(MetalEstimator, QuadratureFollowsAnObjectThatHasMovedSinceTheLastWindow) {
    const Case before = observe(0.02, named("304"), {0.2, 0.08, 0.03}, 1, 5);
    Case now = observe(0.02, named("304"), {0.2, 0.06, 0.03}, 1, 6);
    now.evidence.predicted = before.evidence.predicted;
    const double without = estimate(now).remaining;
    now.evidence.change = 0.3;
    const double with = estimate(now).remaining;
    std::printf("moved by 20 mm: %.3f is left, %.3f if the change is not known\n", with, without);
    EXPECT_LT(with, 0.25);
    EXPECT_LT(with, without);
}

}  // namespace
}  // namespace tricoil::tracking
