#include "sim/world/metal/cylinder.hpp"
#include "tests/metal/added_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;

struct Row {
    double diameter_m, wall_m, conductivity, permeability, hz, across_real, across_imaginary, along_real, along_imaginary;
};
const std::vector<Row> kRows{
#include "tests/metal/cylinder_table.inc"
};

TEST(MetalCylinder, ResponseOfLongRodsAndTubesEqualsTheTable) {
    ASSERT_EQ(kRows.size(), 36U);
    for (const Row& row : kRows) {
        const CylinderResponse response =
            cylinder_response({row.diameter_m, 0.1, row.wall_m}, {row.conductivity, row.permeability, row.permeability}, row.hz);
        const Complex across(row.across_real, row.across_imaginary);
        const Complex along(row.along_real, row.along_imaginary);
        EXPECT_LT(std::abs(response.across - across), 1e-5 * std::abs(across)) << row.diameter_m << " " << row.conductivity;
        EXPECT_LT(std::abs(response.along - along), 1e-5 * std::abs(along)) << row.diameter_m << " " << row.conductivity;
    }
}

TEST(MetalCylinder, ResponseHasItsLimits) {
    const Cylinder rod{0.01, 0.1, 0};
    const Cylinder tube{0.01, 0.1, 0.001};
    for (const Cylinder& c : {rod, tube}) {
        EXPECT_LT(std::abs(cylinder_response(c, {1e8, 1, 1}, 1e11).across + 1.0), 1e-3);
        EXPECT_LT(std::abs(cylinder_response(c, {1e8, 1, 1}, 1e11).along + 1.0), 1e-3);
        EXPECT_LT(std::abs(cylinder_response(c, {1e3, 1, 1}, 1).along), 1e-6);
    }
    const double hollow = 0.8 * 0.8;
    EXPECT_NEAR(cylinder_response(rod, {1, 5, 5}, 1).along.real(), 4, 1e-6);
    EXPECT_NEAR(cylinder_response(rod, {1, 5, 5}, 1).across.real(), 4.0 / 6, 1e-6);
    EXPECT_NEAR(cylinder_response(tube, {1, 5, 5}, 1).along.real(), 4 * (1 - hollow), 1e-6);
    // Static shield, Jackson, Classical Electrodynamics, section 5.12, for a cylinder.
    const double expected = 24 * (1 - hollow) / (36 - 16 * hollow);
    EXPECT_NEAR(cylinder_response(tube, {1, 5, 5}, 1).across.real(), expected, 1e-6);
}

TEST(MetalCylinder, FarAwayARodIsTwoDipoles) {
    const Cylinder rod{0.0079, 0.1, 0};
    const Material titanium{5.85e5, 1, 1};
    const CylinderResponse response = cylinder_response(rod, titanium, 10.5e3);
    const double b2l = 0.00395 * 0.00395 * 0.1;
    const Complex across = far_polarizability(rod, titanium, 10.5e3, Vec3<double>::UnitX(), 10);
    const Complex along = far_polarizability(rod, titanium, 10.5e3, Vec3<double>::UnitZ(), 10);
    EXPECT_LT(std::abs(across - b2l / 2 * response.across), 0.01 * std::abs(across));
    EXPECT_LT(std::abs(along - b2l / 4 * response.along), 0.02 * std::abs(along));
}

TEST(MetalCylinder, DemagnetisationEqualsThatOfAThinConductingRod) {
    // A perfectly permeable rod of length 2 l has the moment of a conducting rod in an electric field,
    // l^3 / (3 (ln(4 l / a) - 7/3)) (Landau and Lifshitz, Electrodynamics of Continuous Media, section 3, problem 2).
    for (const double ratio : {60.0, 120.0}) {
        const Cylinder rod{0.1 / ratio, 0.1, 0};
        const double l = 0.05;
        const double a = rod.diameter_m / 2;
        const double expected = l * l * l / (3 * (std::log(4 * l / a) - 7.0 / 3));
        EXPECT_NEAR(far_polarizability(rod, {1e-3, 1e6, 1e6}, 1, Vec3<double>::UnitZ(), 10).real(), expected, 0.05 * expected);
    }
}

TEST(MetalCylinder, SourceAndSensorCanBeExchanged) {
    const Vec3<double> source(-0.07, 0.01, 0.02);
    const Vec3<double> sensor(0.03, 0.06, -0.05);
    const Material steel{6.29e6, 240, 180};
    const ComplexMat3 there = added_field(Cylinder{0.0127, 0.1, 0.0013}, steel, 1000, source, sensor);
    const ComplexMat3 back = added_field(Cylinder{0.0127, 0.1, 0.0013}, steel, 1000, sensor, source);
    EXPECT_LT((there - back.transpose()).norm(), 1e-3 * there.norm());
}

}  // namespace
}  // namespace tricoil::sim
