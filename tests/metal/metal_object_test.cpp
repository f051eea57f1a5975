// Place, turn and times of a metal object.
#include <gtest/gtest.h>

#include <complex>
#include <numbers>

#include "core/linear/eigen.hpp"
#include "sim/world/metal/metal_set.hpp"

namespace tricoil::sim {
namespace {

ComplexMat3 field_of(const MetalObject& object, const Vec3<double>& sensor_m, double time_s) {
    MetalSet set;
    set.add(object, 0, 1);
    set.tune({1e4});
    return set.field(sensor_m, time_s, time_s)[0];
}

TEST(MetalObject, TurningTheObjectTurnsTheField) {
    const Vec3<double> sensor(0.4, 0.2, 0.1);
    const Quat<double> q = Quat<double>(0.8, 0.2, -0.4, 0.1).normalized();
    const ComplexMat3 r = q.toRotationMatrix().cast<std::complex<double>>();
    MetalObject rod;
    rod.shape = Cylinder{0.01, 0.1, 0};
    rod.material = {6.29e6, 240, 180};
    rod.pose = {{0.3, 0.1, 0}, Quat<double>::Identity()};
    const ComplexMat3 field = field_of(rod, sensor, 0);
    MetalObject turned = rod;
    turned.pose.q_source_sensor = q;
    EXPECT_GT(eigen(field_of(turned, sensor, 0) - field).norm(), 0.1 * eigen(field).norm());
    turned.pose.position_m = q * rod.pose.position_m;
    EXPECT_LT((eigen(field_of(turned, q * sensor, 0)) - eigen(r) * eigen(field) * eigen(r).adjoint()).norm(),
              1e-9 * eigen(field).norm());
}

TEST(MetalObject, AnObjectTurnsAtItsRate) {
    const Vec3<double> sensor(0.4, 0.2, 0.1);
    MetalObject rod;
    rod.shape = Cylinder{0.01, 0.1, 0};
    rod.pose = {{0.3, 0.1, 0}, Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX())};
    MetalObject diagonal = rod;
    diagonal.pose.q_source_sensor = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d(1, 1, 0));
    rod.turn_rad_s << 0, 0, 5;  // from x to y
    const ComplexMat3 expected = field_of(diagonal, sensor, 0);
    EXPECT_LT(eigen(field_of(rod, sensor, 0.05 * std::numbers::pi) - expected).norm(), 1e-9 * eigen(expected).norm());
    EXPECT_GT(eigen(field_of(rod, sensor, 0.1 * std::numbers::pi) - expected).norm(), 0.1 * eigen(expected).norm());
}

TEST(MetalObject, AnObjectActsBetweenItsTimes) {
    MetalSet set;
    MetalObject object;
    object.pose.position_m << 0.3, 0.1, 0;
    set.add(object, 0.5, 1);
    set.tune({1e4});
    for (const double time_s : {0.4, 1.0, 1.5}) {
        EXPECT_TRUE(eigen(set.field({0.6, 0, 0.1}, time_s, time_s)[0]).isZero(0)) << time_s;
        EXPECT_FALSE(set.acts_at(time_s)) << time_s;
    }
    EXPECT_FALSE(eigen(set.field({0.6, 0, 0.1}, 0.5, 0.5)[0]).isZero(0));
    EXPECT_TRUE(set.acts_at(0.5));
}

}  // namespace
}  // namespace tricoil::sim
