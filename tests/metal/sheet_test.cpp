#include "sim/world/metal/sheet.hpp"
#include "tests/metal/added_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;
constexpr double kMu0 = 4e-7 * std::numbers::pi;

/// Integral over kappa of kappa^2 exp(-kappa h) times a reflection: the axial field at h/2 above a large sheet of an axial dipole
/// at the same place.
Complex reflected(double h, const std::function<Complex(double)>& reflection) {
    Complex sum = 0;
    const double step = 0.002 / h;
    for (double kappa = step / 2; kappa * h < 40; kappa += step) {
        sum += step * kappa * kappa * std::exp(-kappa * h) * reflection(kappa);
    }
    return sum;
}

TEST(MetalSheet, ResponsePerAreaHasItsLimits) {
    const SheetResponse thin = sheet_response(1e-4, {1e6, 1, 1}, 100);
    EXPECT_LT(std::abs(thin.impedance_ohm - 0.01), 1e-4 * 0.01);
    EXPECT_LT(std::abs(thin.magnetisation), 1e-4);
    EXPECT_NEAR(sheet_response(1e-3, {1, 240, 240}, 1).magnetisation.real(), 239, 1e-6);
    // Thick: each face has the surface impedance (1 + i) / (sigma delta).
    const double delta = std::sqrt(2 / (2 * std::numbers::pi * 1e4 * kMu0 * 6e7));
    const SheetResponse thick = sheet_response(0.02, {6e7, 1, 1}, 1e4);
    EXPECT_LT(std::abs(thick.impedance_ohm - Complex(1, 1) / (2 * 6e7 * delta)), 1e-6 * std::abs(thick.impedance_ohm));
}

TEST(MetalSheet, WeakCurrentsInASquareEqualTheSeries) {
    // The stream function solves Poisson's equation; its integral over a square of side l is 0.035144 l^4, a quarter of the
    // torsion constant 0.140577 (Timoshenko and Goodier, Theory of Elasticity, section 109).
    const Sheet square{0.2, 0.2, 1e-3};
    const Material metal{1e4, 1, 1};
    const double expected = 2 * std::numbers::pi * 100 * 1e-7 * 1e4 * 1e-3 * 0.035144 * std::pow(0.2, 4);
    const Complex alpha = far_polarizability(square, metal, 100, Vec3<double>::UnitZ(), 40);
    EXPECT_LT(std::abs(alpha - Complex(0, -expected)), 0.03 * expected) << alpha << " " << expected;
}

TEST(MetalSheet, StrongCurrentsInASquareEqualThoseOfAPerfectConductor) {
    // Plate and aperture are dual: four times the electric polarisability of a square aperture, 0.1126 l^3 (De Smedt and Van
    // Bladel, IEEE Trans. Antennas Propag. 28, 1980).
    const Sheet square{0.2, 0.2, 1e-3};
    const double expected = 4 * 0.1126 * std::pow(0.2, 3) / (4 * std::numbers::pi);
    const Complex alpha = far_polarizability(square, {1e8, 1, 1}, 1e9, Vec3<double>::UnitZ(), 40);
    EXPECT_NEAR(alpha.real(), -expected, 0.04 * expected);
}

TEST(MetalSheet, StrongMagnetisationOfASquareEqualsThatOfAPerfectMagnet) {
    // Four times the magnetic polarisability of a square aperture, 0.2590 l^3 (the same source).
    const Sheet square{0.2, 0.2, 0.02};
    const double expected = 4 * 0.2590 * std::pow(0.2, 3) / (4 * std::numbers::pi);
    const Complex alpha = far_polarizability(square, {1e-3, 1e6, 1e6}, 1, Vec3<double>::UnitX(), 40);
    EXPECT_NEAR(alpha.real(), expected, 0.06 * expected);
}

TEST(MetalSheet, NearALargeSheetItReflectsLikeAnInfiniteOne) {
    const Sheet large{0.8, 0.8, 1.3e-3};
    const Vec3<double> place(0, 0, 0.08);
    for (const Material& metal : {Material{5.96e7, 1, 1}, Material{1.39e6, 1, 1}, Material{6.29e6, 240, 180}}) {
        for (const double hz : {326.0, 10500.0}) {
            const SheetResponse response = sheet_response(large.thickness_m, metal, hz);
            const Complex beta = Complex(0, 2 * std::numbers::pi * hz * kMu0) / (2.0 * response.impedance_ohm);
            const Complex half = large.thickness_m * response.magnetisation / 2.0;
            const Complex expected =
                reflected(0.16, [&](double kappa) { return -beta / (kappa + beta) + half * kappa / (1.0 + half * kappa); });
            const Complex added = added_field(large, metal, hz, place, place)(2, 2);
            EXPECT_LT(std::abs(added - expected), 0.04 * std::abs(expected)) << metal.conductivity_s_m << " " << hz;
        }
    }
}

TEST(MetalSheet, SidesKeepTheirDirections) {
    // The long side takes more magnetisation; and the width lies along x.
    const Sheet strip{0.4, 0.1, 1e-3};
    const Material steel{1, 1000, 1000};
    const double x = far_polarizability(strip, steel, 1, Vec3<double>::UnitX(), 40).real();
    const double y = far_polarizability(strip, steel, 1, Vec3<double>::UnitY(), 40).real();
    EXPECT_GT(x, 4 * y);
}

TEST(MetalSheet, SourceAndSensorCanBeExchanged) {
    const Vec3<double> source(-0.07, 0.01, 0.12);
    const Vec3<double> sensor(0.03, 0.06, -0.15);
    const Material steel{6.29e6, 240, 180};
    const ComplexMat3 there = added_field(Sheet{0.3, 0.2, 1e-3}, steel, 1000, source, sensor);
    const ComplexMat3 back = added_field(Sheet{0.3, 0.2, 1e-3}, steel, 1000, sensor, source);
    EXPECT_LT((there - back.transpose()).norm(), 1e-9 * there.norm());
}

}  // namespace
}  // namespace tricoil::sim
