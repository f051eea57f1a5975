// A program outside the tree: couplings of a known pose in, the pose back out.
#include <cstdio>

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/tracking/tracker.hpp"

int main() {
    using namespace tricoil;
    constexpr double kCoupling = 6.75e-3;  // C, coupling units times m^3
    const Vec3<double> position_m(0.4, 0.2, -0.1);
    const auto attitude = geometry::attitude_matrix<double>(geometry::Euler<double>{0.3, -0.2, 0.1});

    tracking::TrackerParams<double> params;
    params.coupling_constant = kCoupling;
    tracking::Tracker<double> tracker(params);
    for (int coil = 0; coil < kSourceCoils; ++coil) {
        Column<double> column;
        column.state = single_coil(coil);
        column.midpoint = device_time_us(1000);
        column.in_phase = field::column_model<double>(kCoupling, position_m, attitude, coil).column;
        column.sigma.setConstant(1e-6);
        if (const auto pose = tracker.update(column)) {
            std::printf("%.6f %.6f %.6f valid %d\n", pose->position_m.x(), pose->position_m.y(), pose->position_m.z(),
                        pose->valid());
            return (pose->position_m - position_m).norm() < 1e-9 ? 0 : 1;
        }
    }
    return 1;
}
