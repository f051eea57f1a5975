// Seeded random poses and noise for tests.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::test {

class RandomPoses {
public:
    explicit RandomPoses(std::uint64_t seed) : engine_(seed) {}

    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    double gaussian() { return normal_(engine_); }

    Vec3<double> gaussian_vector() {
        const double x = gaussian();
        const double y = gaussian();
        return {x, y, gaussian()};
    }

    /// Uniform over the sphere.
    Vec3<double> direction() { return gaussian_vector().normalized(); }

    /// Uniform over all attitudes.
    Quat<double> attitude() {
        Matrix<double, 4, 1> q;
        q << gaussian_vector(), gaussian();
        return Quat<double>(q).normalized();
    }

    Mat3<double> gaussian_matrix() {
        Mat3<double> m;
        for (Index i = 0; i < 9; ++i) {
            m(i) = gaussian();
        }
        return m;
    }

private:
    std::mt19937_64 engine_;
    std::normal_distribution<double> normal_{0, 1};
};

/// X with C = 1 at a pose.
inline Mat3<double> unit_signal(const Vec3<double>& position_m, const Quat<double>& q_source_sensor) {
    return field::signal_matrix<double>(1.0, position_m, geometry::attitude_matrix(q_source_sensor));
}

}  // namespace tricoil::test
