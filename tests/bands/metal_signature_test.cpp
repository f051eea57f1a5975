// Kind and gain of metal from the response of exact spheres in both bands.
#include "core/tracking/dual_band/metal_signature.hpp"

#include <gtest/gtest.h>

#include "sim/world/metal/sphere.hpp"

namespace tricoil::tracking {
namespace {

constexpr MetalSignature::Tones kHigh_hz{7680, 10080, 13440};
constexpr MetalSignature::Tones kLow_hz{480, 720, 960};
constexpr double kNoise = 1e-5;

struct Expected {
    MetalSignature signature{kHigh_hz, kLow_hz};
    Vec3<double> gain;
};

/// Evidence of a sphere whose patterns are random, but known; without redundant numbers.
Expected observe(const sim::Sphere& sphere, const sim::Material& material) {
    Mat3<double> pattern;
    pattern << 0.8, -0.2, 0.4, -0.5, 0.9, 0.1, 0.3, 0.2, -0.7;
    const double scale = 1e-2 / std::abs(sim::sphere_polarisability(sphere, material, 1e4));
    BandEvidence evidence{};
    Expected result;
    for (Eigen::Index j = 0; j < 3; ++j) {
        const auto coil = static_cast<std::size_t>(j);
        const std::complex<double> high = scale * sim::sphere_polarisability(sphere, material, kHigh_hz[coil]);
        const std::complex<double> low = scale * sim::sphere_polarisability(sphere, material, kLow_hz[coil]);
        evidence.difference.col(j) = (high - low).real() * pattern.col(j);
        evidence.low_quadrature.col(j) = low.imag() * pattern.col(j);
        evidence.high_quadrature.col(j) = high.imag() * pattern.col(j);
        result.gain(j) = high.real() / (high - low).real();
    }
    evidence.low_variance = evidence.high_variance = kNoise * kNoise;
    evidence.state_variance = 1e6;  // the redundant numbers say nothing
    evidence.redundant.setZero();
    evidence.redundant_difference.setZero();
    for (int n = 0; n < 20; ++n) {
        result.signature.add(evidence, 0.97);
    }
    return result;
}

TEST(MetalSignature, WithoutEvidenceThePriorIsWide) {
    const MetalSignature signature(kHigh_hz, kLow_hz);
    for (Eigen::Index j = 0; j < 3; ++j) {
        EXPECT_GT(signature.gain()(j), 0);
        EXPECT_LT(signature.gain()(j), 3);
        EXPECT_GT(signature.gain_covariance()(j, j), 0.5);
    }
}

TEST(MetalSignature, PoorConductorsLeaveAlmostNothingInTheLowBand) {
    for (const sim::Material material : {sim::Material{5.85e5, 1, 1}, sim::Material{1.39e6, 1, 1}}) {
        const Expected r = observe({0.01}, material);
        for (Eigen::Index j = 0; j < 3; ++j) {
            EXPECT_NEAR(r.signature.gain()(j), r.gain(j), 0.1) << material.conductivity_s_m;
        }
        EXPECT_LT(r.signature.ferromagnetic(), 0.1);
    }
}

TEST(MetalSignature, FerromagneticMetalIsToldApart) {
    const Expected steel = observe({0.03}, {6.29e6, 240, 180});
    EXPECT_GT(steel.signature.ferromagnetic(), 0.9);
    for (Eigen::Index j = 0; j < 3; ++j) {
        EXPECT_NEAR(steel.signature.gain()(j), steel.gain(j), 0.5);
    }
    EXPECT_LT(observe({0.03}, {3.77e7, 1, 1}).signature.ferromagnetic(), 0.5);
}

TEST(MetalSignature, GainOfAThickConductorIsWithinItsSigma) {
    const Expected r = observe({0.03}, {3.77e7, 1, 1});
    for (Eigen::Index j = 0; j < 3; ++j) {
        EXPECT_NEAR(r.signature.gain()(j), r.gain(j), 3 * std::sqrt(r.signature.gain_covariance()(j, j)));
    }
}

}  // namespace
}  // namespace tricoil::tracking
