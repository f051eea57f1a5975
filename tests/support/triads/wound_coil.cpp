#include "tests/support/triads/wound_coil.hpp"

#include <cmath>
#include <numbers>

#include "core/geometry/rotations.hpp"

namespace tricoil::sim {

std::vector<Filament> filaments_of(const WoundCoilParams& params) {
    const Vec3<double> axis = params.axis.normalized();
    const auto across = geometry::transverse_axes<double>(axis);
    const double step = 2 * std::numbers::pi / params.segments;
    // A polygon with n corners at radius R has the area n/2 R^2 sin(2 pi / n). The radius is increased so that the area equals
    // that of the circle.
    const double corner = params.radius_m * std::sqrt(step / std::sin(step));
    std::vector<Filament> filaments;
    for (int turn = 0; turn < params.turns; ++turn) {
        const double z = params.length_m * ((turn + 0.5) / params.turns - 0.5);
        const auto at = [&](int k) -> Vec3<double> {
            return params.centre_m + z * axis +
                   corner * (std::cos(k * step) * across.col(0) + std::sin(k * step) * across.col(1));
        };
        for (int k = 0; k < params.segments; ++k) {
            filaments.push_back({0.5 * (at(k) + at(k + 1)), at(k + 1) - at(k)});
        }
    }
    return filaments;
}

double mutual_coupling(const std::vector<Filament>& source, const std::vector<Filament>& sensor) {
    double sum = 0;
    for (const Filament& a : source) {
        for (const Filament& b : sensor) {
            sum += a.along_m.dot(b.along_m) / (a.middle_m - b.middle_m).norm();
        }
    }
    return sum;
}

double winding_scale(const WoundCoilParams& source, const WoundCoilParams& sensor) {
    // Neumann's integral of two far loops of areas A, B: A B (3 (a.u)(b.u) - a.b) / r^3. dipole_pair has half of that for unit
    // moments.
    const auto area = [](const WoundCoilParams& c) { return c.turns * std::numbers::pi * c.radius_m * c.radius_m; };
    return 0.5 * source.axis.norm() * sensor.axis.norm() / (area(source) * area(sensor));
}

}  // namespace tricoil::sim
