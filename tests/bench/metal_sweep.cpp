// Detection of metal from nine couplings: a conducting sphere at many places near a resting sensor.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <random>

#include "core/field/general_dipole.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"
#include "tests/support/column_replay.hpp"

namespace {

using namespace tricoil;

constexpr int kPlacesPerSize = 3000;
constexpr int kFrames = 24;          // 0.1 s
constexpr double kNotable_m = 1e-3;  // an error that matters to a user

struct Tally {
    int notable = 0;
    int flagged = 0;
    int false_alarms = 0;
    int harmless = 0;
    double worst_unflagged_m = 0;
};

Vec3<double> random_vector(std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    return {normal(random), normal(random), normal(random)};
}

/// Term that a perfectly conducting sphere adds to (6): a field B at its centre induces the moment -2 pi r^3 B / mu_0 (Jackson,
/// Classical Electrodynamics, section 5.9), in the units of (6) a dipole of -r^3 B. Its eddy currents have no phase lag, so the
/// quadrature part is zero: the hardest case.
Mat3<double> sphere_couplings(const Vec3<double>& centre_m, double radius_m, const Vec3<double>& sensor_m,
                              const Mat3<double>& o) {
    const Mat3<double> at_sphere = field::signal_matrix<double>(test::kCoupling, centre_m, Mat3<double>::Identity());
    const Mat3<double> onwards = field::signal_matrix<double>(radius_m * radius_m * radius_m, sensor_m - centre_m, o);
    return -onwards * at_sphere;
}

/// A resting sensor beside a sphere: adds the error of the filter's pose after 0.1 s and its flags to the tally.
void add_place(double radius_m, std::mt19937_64& random, Tally& tally) {
    std::uniform_real_distribution<double> uniform(0, 1);
    const Vec3<double> sensor = (0.25 + 0.65 * uniform(random)) * random_vector(random).normalized();
    const Vec3<double> centre = sensor + (radius_m + 0.03 + 0.4 * uniform(random)) * random_vector(random).normalized();
    if (centre.norm() < radius_m + 0.05) {
        return;  // too close to the source
    }
    const Mat3<double> o = geometry::rotation_vector_to_quaternion<double>(2 * random_vector(random)).toRotationMatrix();
    const Mat3<double> x =
        field::signal_matrix<double>(test::kCoupling, sensor, o) + sphere_couplings(centre, radius_m, sensor, o);
    const double sigma = test::sigma_for_cost(0.05e-3);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(false, sensor));
    std::optional<tracking::PoseEstimate<double>> last;
    bool flagged = false;
    for (int frame = 0; frame < kFrames; ++frame) {
        for (int j = 0; j < 3; ++j) {
            Column<double> column;
            column.state = single_coil(j);
            column.midpoint = DeviceTime{Microseconds{4167 * frame}};
            column.in_phase = x.col(j) + sigma * random_vector(random);
            column.sigma.setConstant(sigma);
            const auto e = filter.update(column);
            last = e ? e : last;
        }
        flagged = last && (!last->valid() || last->flags.has(tracking::PoseFlag::distorted));
    }
    const double error = last ? (last->position_m - sensor).norm() : 0;
    tally.worst_unflagged_m = flagged ? tally.worst_unflagged_m : std::max(tally.worst_unflagged_m, error);
    const bool notable = error > kNotable_m;
    (notable ? tally.notable : tally.harmless) += 1;
    (notable ? tally.flagged : tally.false_alarms) += flagged ? 1 : 0;
}

}  // namespace

int main() {
    fmt::print(
        "conducting sphere with its surface 3 to 43 cm from a resting sensor; sensor at 0.25 to 0.9 m; noise causes 0.05 mm at "
        "0.75 m\n");
    fmt::print("{:>9} {:>18} {:>9} {:>22} {:>18}\n", "radius", "places > 1 mm off", "flagged", "worst unflagged error",
               "flagged below 1 mm");
    std::mt19937_64 random(1);
    for (const double radius_m : {0.005, 0.01, 0.02, 0.04, 0.08}) {
        Tally tally;
        for (int n = 0; n < kPlacesPerSize; ++n) {
            add_place(radius_m, random, tally);
        }
        fmt::print("{:6.0f} mm {:18} {:8.1f} % {:19.2f} mm {:16.1f} %\n", 1e3 * radius_m, tally.notable,
                   tally.notable > 0 ? 100.0 * tally.flagged / tally.notable : 0.0, 1e3 * tally.worst_unflagged_m,
                   tally.harmless > 0 ? 100.0 * tally.false_alarms / tally.harmless : 0.0);
    }
    return 0;
}
