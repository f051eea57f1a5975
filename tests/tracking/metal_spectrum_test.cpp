// Effect of non-magnetic metal from its quadratures and the difference of the bands: exact spheres (Wait 1951).
#include <gtest/gtest.h>

#include <cmath>

#include "core/tracking/metal/metal_spectrum.hpp"
#include "sim/world/metal/sphere.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kLow_hz = 690;
constexpr double kHigh_hz = 10.1e3;

/// Of a sphere. All its couplings have the same ratios.
MetalSignals ratios_of(const sim::Material& material, double radius_m) {
    const auto low = sim::sphere_polarisability({radius_m}, material, kLow_hz);
    const auto high = sim::sphere_polarisability({radius_m}, material, kHigh_hz);
    return MetalSignals(low.imag(), high.imag(), high.real() - low.real()) / high.real();
}

const MetalSignals kLittle = MetalSignals::Constant(1e-8);

TEST(MetalSpectrum, GivesTheEffectOfNonMagneticSpheres) {
    for (const double conductivity_s_m : {5.8e7, 2.5e7, 1.4e6, 5.8e5}) {
        for (const double radius_m : {0.005, 0.01, 0.02, 0.04}) {
            const MetalSignals ratios = ratios_of({conductivity_s_m}, radius_m);
            const auto spectrum = MetalSpectrum::fit(ratios, kLittle);
            ASSERT_TRUE(spectrum) << conductivity_s_m << " " << radius_m;
            const auto [weights, variance] = spectrum->extrapolate(1, kLittle);
            EXPECT_NEAR(weights.dot(ratios), 1, 0.08) << conductivity_s_m << " " << radius_m;
            EXPECT_LT(variance, 0.1) << conductivity_s_m << " " << radius_m;
        }
    }
}

TEST(MetalSpectrum, IsUnknownForFerromagneticMetal) {
    for (const auto& [name, description, material] : sim::materials()) {
        const bool is_magnetic = material.permeability_high > 2;
        for (const double radius_m : {0.01, 0.02}) {
            for (const double variance : {1e-8, 5e-4}) {
                const auto spectrum = MetalSpectrum::fit(ratios_of(material, radius_m), MetalSignals::Constant(variance));
                EXPECT_EQ(spectrum.has_value(), !is_magnetic) << name << " " << radius_m << " " << variance;
            }
        }
    }
}

TEST(MetalSpectrum, IsUnknownIfNoiseHidesTheRatios) {
    const MetalSignals ratios = ratios_of({2.5e7}, 0.01);
    EXPECT_FALSE(MetalSpectrum::fit(ratios, MetalSignals(0.02, 1e-8, 1e-8)));
    EXPECT_FALSE(MetalSpectrum::fit(ratios, MetalSignals::Constant(std::nan(""))));
}

/// Motion hides the quadratures; then the estimate rests on the difference of the bands, and is less certain.
TEST(MetalSpectrum, NoisySignalsHaveLittleWeight) {
    const MetalSignals ratios = ratios_of({2.5e7}, 0.01);
    const auto spectrum = MetalSpectrum::fit(ratios, kLittle);
    ASSERT_TRUE(spectrum);
    const auto rest = spectrum->extrapolate(1, kLittle);
    const auto moving = spectrum->extrapolate(1, MetalSignals(100, 100, 1e-8));
    EXPECT_LT(std::abs(moving.weights(0)) + std::abs(moving.weights(1)), 0.01);
    EXPECT_NEAR(moving.weights(2) * ratios(2), 1, 0.1);
    EXPECT_GT(moving.variance, 2 * rest.variance);
}

}  // namespace
}  // namespace tricoil::tracking
