#include "sim/world/metal/sphere.hpp"
#include "tests/metal/added_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;

const Vec3<double> kNearSource{-0.07, 0.01, 0.02};
const Vec3<double> kNearSensor{0.03, 0.06, -0.05};

struct CoefficientRow {
    int order;
    double radius_m, conductivity, permeability, hz, real, imaginary;
};
struct CouplingRow {
    double conductivity, permeability, hz;
    std::array<Complex, 9> values;
};

#define COEFFICIENT(...) {__VA_ARGS__},
#define COUPLINGS(...)
const std::vector<CoefficientRow> kCoefficients{
#include "tests/metal/sphere_table.inc"
};
#undef COEFFICIENT
#undef COUPLINGS
#define COEFFICIENT(...)
#define COUPLINGS(conductivity, permeability, hz, ...) {conductivity, permeability, hz, {{__VA_ARGS__}}},
const std::vector<CouplingRow> kCouplings{
#include "tests/metal/sphere_table.inc"
};

TEST(MetalSphere, CoefficientsEqualTheTable) {
    ASSERT_EQ(kCoefficients.size(), 216U);
    for (const CoefficientRow& row : kCoefficients) {
        const Material material{row.conductivity, row.hz < 1e4 ? row.permeability : 1, row.hz > 500 ? row.permeability : 1};
        const Complex expected(row.real, row.imaginary);
        const Complex a = sphere_coefficient(row.order, propagation_constant(material, row.hz) * row.radius_m, row.permeability);
        EXPECT_LT(std::abs(a - expected), 1e-10 * std::abs(expected))
            << row.order << " " << row.radius_m << " " << row.conductivity << " " << row.hz;
    }
}

TEST(MetalSphere, CouplingsNearTheSphereEqualTheTable) {
    ASSERT_EQ(kCouplings.size(), 3U);
    for (const CouplingRow& row : kCouplings) {
        const Material material{row.conductivity, row.permeability, row.permeability};
        const ComplexMat3 field = added_field(Sphere{0.04}, material, row.hz, kNearSource, kNearSensor);
        ComplexMat3 expected;
        for (Index i = 0; i < 9; ++i) {
            expected(i / 3, i % 3) = row.values[static_cast<std::size_t>(i)];
        }
        EXPECT_LT(eigen(field - expected).norm(), 1e-7 * eigen(expected).norm()) << eigen(field) << "\n\n" << eigen(expected);
    }
}

TEST(MetalSphere, PolarisabilityHasItsLimits) {
    const Sphere sphere{0.03};
    const double a3 = 0.03 * 0.03 * 0.03;
    const auto alpha = [&](double conductivity, double permeability, double hz) {
        return sphere_polarisability(sphere, {conductivity, permeability, permeability}, hz);
    };
    EXPECT_LT(std::abs(alpha(1e8, 1, 1e12) + a3 / 2), 1e-4 * a3);    // perfect conductor
    EXPECT_LT(std::abs(alpha(1e6, 1e6, 1e-9) - a3), 1e-5 * a3);      // perfect magnet, static
    EXPECT_LT(std::abs(alpha(1e6, 1, 1e-6)), 1e-6 * a3);             // non-magnetic, static
    EXPECT_NEAR(alpha(1e6, 5, 1e-9).real(), a3 * 4 / 7, 1e-6 * a3);  // (mu - 1) / (mu + 2)
    // Weak eddy currents, Landau and Lifshitz, Electrodynamics of Continuous Media, section 59: -i a^5 w mu0 sigma / 30.
    const double weak = std::pow(0.03, 5) * 2 * M_PI * 4e-7 * M_PI * 1e6 / 30;
    EXPECT_LT(std::abs(alpha(1e6, 1, 1) - Complex(0, -weak)), 1e-3 * weak);
}

TEST(MetalSphere, PolarisabilityOfPresetsEqualsPublishedFigures) {
    const auto share = [](const char* name, double radius_m, double hz) {
        for (const NamedMaterial& m : materials()) {
            if (m.name == name) {
                return sphere_polarisability(Sphere{radius_m}, m.material, hz) / (std::pow(radius_m, 3) / 2);
            }
        }
        return Complex();
    };
    // Worked examples for the tracker's carriers, two digits.
    EXPECT_LT(std::abs(share("aluminium", 0.03, 10.5e3) - Complex(-0.96, -0.04)), 0.01);
    EXPECT_LT(std::abs(share("aluminium", 0.03, 300) - Complex(-0.76, -0.20)), 0.01);
    EXPECT_LT(std::abs(share("304", 0.01, 10.5e3) - Complex(-0.36, -0.36)), 0.02);
}

TEST(MetalSphere, PerfectConductorLetsNoFieldThrough) {
    // The normal component of source field plus added field vanishes on the surface: sums the multipoles of all orders.
    const Sphere sphere{0.04};
    const Material material{1e8, 1, 1};
    for (const Vec3<double>& n : {Vec3<double>(1, 0, 0), Vec3<double>(-0.6, 0.8, 0), Vec3<double>(0.48, -0.6, 0.64)}) {
        const Vec3<double> surface = 0.04 * n;
        const Vec3<double> applied = unit_dipole_field(surface - kNearSource).transpose() * n;
        const Vec3<double> added =
            Mat3<double>(eigen(added_field(sphere, material, 1e14, kNearSource, surface)).real()).transpose() * n;
        EXPECT_LT((applied + added).norm(), 2e-3 * applied.norm());
    }
}

TEST(MetalSphere, StrongMagnetTakesTheFieldAtRightAngles) {
    const Sphere sphere{0.04};
    const Material material{1e-3, 1e6, 1e6};
    const Vec3<double> n(0.48, -0.6, 0.64);
    const Mat3<double> total = unit_dipole_field(0.04 * n - kNearSource) +
                               Mat3<double>(eigen(added_field(sphere, material, 1e-3, kNearSource, 0.04 * n)).real());
    const Mat3<double> tangential = total - n * n.transpose() * total;
    EXPECT_LT(tangential.norm(), 2e-3 * total.norm());
}

TEST(MetalSphere, FarAwayItIsADipole) {
    const Vec3<double> source(-0.9, 0.2, 0.1);
    const Vec3<double> sensor(0.3, 0.7, -0.6);
    const Material material{3.77e7, 1, 1};
    const Complex alpha = sphere_polarisability(Sphere{0.01}, material, 1000);
    const ComplexMat3 expected = alpha * (unit_dipole_field(sensor) * unit_dipole_field(source)).cast<Complex>();
    EXPECT_LT(eigen(added_field(Sphere{0.01}, material, 1000, source, sensor) - expected).norm(), 1e-3 * eigen(expected).norm());
}

TEST(MetalSphere, SourceAndSensorCanBeExchanged) {
    const Material steel{6.29e6, 240, 180};
    const ComplexMat3 there = added_field(Sphere{0.04}, steel, 1000, kNearSource, kNearSensor);
    const ComplexMat3 back = added_field(Sphere{0.04}, steel, 1000, kNearSensor, kNearSource);
    EXPECT_LT(eigen(there - back.transpose()).norm(), 1e-12 * eigen(there).norm());
}

}  // namespace
}  // namespace tricoil::sim
