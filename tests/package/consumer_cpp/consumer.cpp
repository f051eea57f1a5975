// Example program outside the tree: computes a pose and its uncertainty from nine couplings.
#include <cstdio>

#include <tricoil/core/field/concentric_dipole.hpp>
#include <tricoil/core/geometry/angles.hpp>
#include <tricoil/core/solver/direct.hpp>
#include <tricoil/core/solver/pose_covariance.hpp>

int main() {
    using namespace tricoil;
    const double coupling_constant = 6.75e-3;  // of the coils, coupling units times m^3
    const Vec3<double> truth_m(0.4, 0.1, -0.2);
    const Mat3<double> attitude = geometry::attitude_matrix(geometry::Euler<double>{0.3, -0.2, 0.1});
    const double k = field::coupling_strength(coupling_constant, truth_m.norm());
    const Mat3<double> x = k * attitude * field::dipole_factor<double>(truth_m.normalized());

    const auto pose = solver::solve_direct(x, coupling_constant);
    if (!pose.ok()) {
        std::fprintf(stderr, "no pose: %s\n", pose.status().message());
        return 1;
    }
    const double side = pose->direction.dot(truth_m) < 0 ? -1 : 1;  // nine couplings do not determine the hemisphere
    const Vec3<double> found_m = side * pose->range_m * pose->direction;
    const auto covariance = solver::pose_covariance<double>(k, pose->range_m, pose->direction, 1e-3 * k);
    std::printf("%.6f %.6f %.6f m, at 60 dB +- %.3f mm\n", found_m.x(), found_m.y(), found_m.z(),
                1e3 * std::sqrt(covariance.topLeftCorner<3, 3>().trace()));
    return (found_m - truth_m).norm() < 1e-9 ? 0 : 1;
}
