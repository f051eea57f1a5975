#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "core/field/general_dipole.hpp"
#include "tests/support/triads/data_set.hpp"

namespace tricoil::sim {
namespace {

double coupled(const WoundCoilParams& source, const WoundCoilParams& sensor) {
    return winding_scale(source, sensor) * mutual_coupling(filaments_of(source), filaments_of(sensor));
}

TEST(WoundCoil, ConvergesToADipoleWithOctupoleAsNextTerm) {
    WoundCoilParams source;
    source.axis = Vec3<double>(0.3, -0.2, 0.9).normalized();
    source.radius_m = 0.02;
    source.length_m = 0.02;
    source.turns = 12;
    source.segments = 48;
    WoundCoilParams sensor;
    sensor.axis = Vec3<double>(-0.5, 0.6, 0.4).normalized();
    sensor.radius_m = 1e-3;
    sensor.length_m = 1e-3;
    sensor.turns = 2;
    sensor.segments = 12;
    const double lambda = source.length_m * source.length_m / 24 - source.radius_m * source.radius_m / 8;
    for (const double range : {2.0, 0.3, 0.2}) {
        sensor.centre_m = range * Vec3<double>(0.7, 0.5, -0.4).normalized();
        const double dipole = field::dipole_pair<double>(sensor.centre_m, source.axis, sensor.axis).value;
        const double octupole = field::octupole_correction<double>(sensor.centre_m, source.axis, sensor.axis, lambda, 0.0).value;
        const double error = coupled(source, sensor) / dipole - 1;
        const double rest = coupled(source, sensor) / (dipole + octupole) - 1;
        std::cout << range << " m: dipole misses " << error << ", with octupole " << rest << "\n";
        EXPECT_LT(std::abs(rest), 0.1 * std::abs(error) + 3e-4);
    }
}

TEST(WoundCoil, IsReciprocal) {
    WoundCoilParams a;
    a.axis = Vec3<double>(0.3, -0.2, 0.9);
    WoundCoilParams b;
    b.centre_m = {0.1, 0.05, -0.07};
    b.axis = Vec3<double>(-0.5, 0.6, 0.4);
    b.radius_m = 0.005;
    EXPECT_NEAR(coupled(a, b), coupled(b, a), 1e-9 * std::abs(coupled(a, b)));
}

}  // namespace
}  // namespace tricoil::sim
