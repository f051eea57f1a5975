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
constexpr double kDiscretisation = 0.03;  // at two cells from the sheet: sim/world/metal/README.md

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
    const Complex alpha = far_polarisability(square, metal, 100, Vec3<double>::UnitZ(), 40);
    EXPECT_LT(std::abs(alpha - Complex(0, -expected)), 0.03 * expected) << alpha << " " << expected;
}

TEST(MetalSheet, StrongCurrentsInASquareEqualThoseOfAPerfectConductor) {
    // Plate and aperture are dual: four times the electric polarisability of a square aperture, 0.1126 l^3 (De Smedt and Van
    // Bladel, IEEE Trans. Antennas Propag. 28, 1980).
    const Sheet square{0.2, 0.2, 1e-3};
    const double expected = 4 * 0.1126 * std::pow(0.2, 3) / (4 * std::numbers::pi);
    const Complex alpha = far_polarisability(square, {1e8, 1, 1}, 1e9, Vec3<double>::UnitZ(), 40);
    EXPECT_NEAR(alpha.real(), -expected, 0.04 * expected);
}

TEST(MetalSheet, StrongMagnetisationOfASquareEqualsThatOfAPerfectMagnet) {
    // Four times the magnetic polarisability of a square aperture, 0.2590 l^3 (the same source).
    const Sheet square{0.2, 0.2, 0.02};
    const double expected = 4 * 0.2590 * std::pow(0.2, 3) / (4 * std::numbers::pi);
    const Complex alpha = far_polarisability(square, {1e-3, 1e6, 1e6}, 1, Vec3<double>::UnitX(), 40);
    EXPECT_NEAR(alpha.real(), expected, 0.06 * expected);
}

/// Centres of the 4 mm squares of a sheet, and its area element.
template <typename Function>
void for_each_square(const Sheet& sheet, const Function& function) {
    constexpr double kSquare_m = 4e-3;
    for (double x = (kSquare_m - sheet.width_m) / 2; x < sheet.width_m / 2; x += kSquare_m) {
        for (double y = (kSquare_m - sheet.height_m) / 2; y < sheet.height_m / 2; y += kSquare_m) {
            function(Vec3<double>(x, y, 0), kSquare_m * kSquare_m);
        }
    }
}

const Sheet kPlate{0.8, 0.4, 1.3e-3};
const Vec3<double> kPlateSource(0.13, -0.09, 0.08);  // two cells from the plate
const Vec3<double> kPlateSensor(-0.06, 0.05, 0.1);

/// Weak currents, exact for a finite plate: the stream function solves Z laplace(psi) = i w B_z, psi = 0 at the edges, and is a
/// sum of products of sines. In units of -i w mu0 / (4 pi Z).
Mat3<double> weak_currents() {
    constexpr int kOrders = 60;
    Eigen::MatrixX3d source = Eigen::MatrixX3d::Zero(kOrders * kOrders, 3);
    Eigen::MatrixX3d sensor = source;
    for_each_square(kPlate, [&](const Vec3<double>& p, double area) {
        const Eigen::RowVector3d from_source = area * eigen(unit_dipole_field(p - kPlateSource).row(2));
        const Eigen::RowVector3d from_sensor = area * eigen(unit_dipole_field(p - kPlateSensor).row(2));
        for (int m = 0; m < kOrders; ++m) {
            const double sine_x = std::sin(std::numbers::pi * (m + 1) * (p.x() / kPlate.width_m + 0.5));
            for (int n = 0; n < kOrders; ++n) {
                const double sines = sine_x * std::sin(std::numbers::pi * (n + 1) * (p.y() / kPlate.height_m + 0.5));
                source.row(m * kOrders + n) += sines * from_source;
                sensor.row(m * kOrders + n) += sines * from_sensor;
            }
        }
    });
    Mat3<double> sum = Mat3<double>::Zero();
    for (int m = 0; m < kOrders; ++m) {
        for (int n = 0; n < kOrders; ++n) {
            const double wave_number = std::numbers::pi * std::hypot((m + 1) / kPlate.width_m, (n + 1) / kPlate.height_m);
            const double norm = kPlate.width_m * kPlate.height_m / 4;
            sum += Mat3<double>(sensor.row(m * kOrders + n).transpose() * source.row(m * kOrders + n) /
                                (norm * wave_number * wave_number));
        }
    }
    return sum;
}

TEST(MetalSheet, WeakCurrentsNearASheetEqualTheSeries) {
    const Material metal{1e4, 1, 1};
    const double unit = 2 * std::numbers::pi * 100 * 1e-7 * 1e4 * kPlate.thickness_m;
    const ComplexMat3 expected = Complex(0, -unit) * weak_currents().cast<Complex>();
    const ComplexMat3 added = added_field(kPlate, metal, 100, kPlateSource, kPlateSensor);
    EXPECT_LT(eigen(added - expected).norm(), kDiscretisation * eigen(expected).norm()) << eigen(added) << "\n\n"
                                                                                        << eigen(expected);
}

TEST(MetalSheet, WeakMagnetisationNearASheetEqualsTheIntegral) {
    // Each part of the sheet is magnetised by the source's field alone.
    const Material metal{1, 1.001, 1.001};
    Mat3<double> sum = Mat3<double>::Zero();
    for_each_square(kPlate, [&](const Vec3<double>& p, double area) {
        sum += area * unit_dipole_field(p - kPlateSensor).leftCols<2>() * unit_dipole_field(p - kPlateSource).topRows<2>();
    });
    const Mat3<double> expected = kPlate.thickness_m * 0.001 / (4 * std::numbers::pi) * sum;
    const Mat3<double> added = eigen(added_field(kPlate, metal, 1, kPlateSource, kPlateSensor)).real();
    EXPECT_LT(eigen(added - expected).norm(), kDiscretisation * eigen(expected).norm()) << eigen(added) << "\n\n"
                                                                                        << eigen(expected);
}

TEST(MetalSheet, NearALargeSheetItReflectsLikeAnInfiniteOne) {
    // Strong currents of an infinite sheet fall with the fourth power of the distance, so that the edges matter little. Weak ones
    // (304 at 326 Hz) reach the edges: see the series above. Currents and magnetisation of steel oppose each other; each has
    // its own limit.
    const Sheet large{0.8, 0.8, 1.3e-3};
    const Vec3<double> place(0, 0, 0.08);
    const Material copper{5.96e7, 1, 1};
    const Material stainless{1.39e6, 1, 1};
    const Material steel{6.29e6, 240, 180};
    const Material magnet{1e-3, 240, 240};
    for (const auto& [metal, hz] : {std::pair(copper, 326.0), std::pair(copper, 10.5e3), std::pair(stainless, 10.5e3),
                                    std::pair(steel, 326.0), std::pair(steel, 10.5e3), std::pair(magnet, 1.0)}) {
        const SheetResponse response = sheet_response(large.thickness_m, metal, hz);
        const Complex beta = Complex(0, 2 * std::numbers::pi * hz * kMu0) / (2.0 * response.impedance_ohm);
        const Complex half = large.thickness_m * response.magnetisation / 2.0;
        const Complex currents = reflected(0.16, [&](double kappa) { return -beta / (kappa + beta); });
        const Complex magnetisation = reflected(0.16, [&](double kappa) { return half * kappa / (1.0 + half * kappa); });
        const Complex added = added_field(large, metal, hz, place, place)(2, 2);
        const double limit = 0.04 * std::abs(currents) + 0.05 * std::abs(magnetisation);  // sim/world/metal/README.md
        EXPECT_LT(std::abs(added - currents - magnetisation), limit) << metal.conductivity_s_m << " " << hz;
    }
}

TEST(MetalSheet, SidesKeepTheirDirections) {
    // The magnetisation is larger along the long side, the width, which is parallel to x.
    const Sheet strip{0.4, 0.1, 1e-3};
    const Material steel{1, 1000, 1000};
    const double x = far_polarisability(strip, steel, 1, Vec3<double>::UnitX(), 40).real();
    const double y = far_polarisability(strip, steel, 1, Vec3<double>::UnitY(), 40).real();
    EXPECT_GT(x, 4 * y);
}

TEST(MetalSheet, SourceAndSensorCanBeExchanged) {
    const Vec3<double> source(-0.07, 0.01, 0.12);
    const Vec3<double> sensor(0.03, 0.06, -0.15);
    const Material steel{6.29e6, 240, 180};
    const ComplexMat3 there = added_field(Sheet{0.3, 0.2, 1e-3}, steel, 1000, source, sensor);
    const ComplexMat3 back = added_field(Sheet{0.3, 0.2, 1e-3}, steel, 1000, sensor, source);
    EXPECT_LT(eigen(there - back.transpose()).norm(), 1e-9 * eigen(there).norm());
}

}  // namespace
}  // namespace tricoil::sim
