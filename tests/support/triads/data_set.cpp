#include "tests/support/triads/data_set.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/base/angle_units.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::sim {
namespace {

constexpr std::array<const char*, 3> kFixtures{"YoutZup", "ZinXdown", "ZinYup"};

Mat3<double> fixture_rotation(int fixture) {
    Mat3<double> r = Mat3<double>::Identity();
    if (fixture == 1) {
        r << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    } else if (fixture == 2) {
        r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    }
    return r;
}

Vec3<double> random_vector(std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    const double x = normal(random);
    const double y = normal(random);
    return {x, y, normal(random)};
}

Mat3<double> small_turn(std::mt19937_64& random, double deg) {
    const Vec3<double> axis = random_vector(random).normalized();
    return geometry::rotation_vector_to_quaternion<double>(deg * kRadians * axis).toRotationMatrix();
}

/// Coil positions on the axes, relative to their mean; any two are `spacing_m` apart.
Vec3<double> corner(int j, double spacing_m) {
    return spacing_m / std::sqrt(2.0) * (Vec3<double>::Unit(j) - Vec3<double>::Constant(1.0 / 3));
}

WoundCoilParams moved(WoundCoilParams coil, const Vec3<double>& position_m, const Mat3<double>& rotation) {
    coil.centre_m = position_m + rotation * coil.centre_m;
    coil.axis = rotation * coil.axis;
    return coil;
}

}  // namespace

RealTriads make_triads(double spacing_m, double skew_deg, double source_radius_m, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> gain(0.95, 1.05);
    RealTriads triads;
    for (int j = 0; j < 3; ++j) {
        const auto k = static_cast<std::size_t>(j);
        triads.source[k].centre_m = corner(j, spacing_m);
        triads.source[k].axis = gain(random) * (small_turn(random, skew_deg) * Vec3<double>::Unit(j));
        triads.source[k].radius_m = source_radius_m;
        triads.source[k].length_m = source_radius_m;
        triads.sensor[k].centre_m = 1e-3 * random_vector(random);
        triads.sensor[k].axis = gain(random) * (small_turn(random, skew_deg) * Vec3<double>::Unit(j));
        triads.sensor[k].radius_m = 3e-3;
        triads.sensor[k].length_m = 4e-3;
        triads.sensor[k].turns = 2;
        triads.sensor[k].segments = 12;
    }
    return triads;
}

Mat3<double> coupling_matrix(const RealTriads& triads, const Vec3<double>& position_m, const Mat3<double>& o) {
    std::array<std::vector<Filament>, 3> source;
    for (std::size_t j = 0; j < 3; ++j) {
        source[j] = filaments_of(triads.source[j]);
    }
    Mat3<double> x;
    for (std::size_t i = 0; i < 3; ++i) {
        const WoundCoilParams placed = moved(triads.sensor[i], position_m, o.transpose());
        const auto sensor = filaments_of(placed);
        for (std::size_t j = 0; j < 3; ++j) {
            x(static_cast<Index>(i), static_cast<Index>(j)) =
                triads.coupling_constant * winding_scale(triads.source[j], placed) * mutual_coupling(source[j], sensor);
        }
    }
    return x;
}

std::string ilemt_name(int sensor_fixture, const std::string& suffix) {
    return fmt::format("soYoutZup_se{}_{}.dat", kFixtures[static_cast<std::size_t>(sensor_fixture)], suffix);
}

std::string ilemt_text(const RealTriads& triads, const StageParams& stage, int sensor_fixture) {
    std::mt19937_64 mounting(77 + static_cast<std::uint64_t>(sensor_fixture));  // equal in all files of this fixture
    std::mt19937_64 common(76);                                                 // equal in all files
    std::mt19937_64 random(stage.seed + 1000 * static_cast<std::uint64_t>(sensor_fixture));
    std::normal_distribution<double> normal(0, 1);
    const Mat3<double> source_stage =
        stage.source_turn * small_turn(common, 4) * geometry::rotation_z<double>(std::numbers::pi / 2);
    const Vec3<double> source_offset = stage.source_turn * Vec3<double>(stage.distance_m, 0.02, -0.01);
    const Mat3<double> mount_sensor = fixture_rotation(sensor_fixture) * small_turn(mounting, 0.4) * small_turn(common, 2);
    const Vec3<double> mount_offset = 1e-3 * random_vector(mounting);
    std::string text;
    for (const double turn_deg : stage.turns_deg) {
        const Mat3<double> turn = geometry::rotation_z<double>(turn_deg * kRadians).transpose();
        for (int n = 0; n < stage.steps * stage.steps * stage.steps; ++n) {
            const int row = n / stage.steps % stage.steps;
            const int layer = n / stage.steps / stage.steps;
            const Vec3<double> cell(n % stage.steps, row, layer);
            const Vec3<double> t = stage.half_width_m * (2 * cell / (stage.steps - 1) - Vec3<double>::Ones());
            const Vec3<double> true_t =
                t + turn * stage.turning * turn.transpose() * t + stage.position_sigma_m * random_vector(random);
            const Vec3<double> p = source_offset + source_stage * (true_t + turn * mount_offset);
            const Mat3<double> o = (source_stage * turn * mount_sensor).transpose();
            Mat3<double> x = coupling_matrix(triads, p, o);
            const double sigma = stage.noise_share * x.cwiseAbs().maxCoeff();
            text +=
                fmt::format("{:.5f}\t{:.5f}\t{:.5f}\t0.00000\t0.00000\t{:.5f}", 1e3 * t.x(), 1e3 * t.y(), 1e3 * t.z(), turn_deg);
            for (Index k = 0; k < 9; ++k) {
                const double value = x(k / 3, k % 3) + sigma * normal(random);
                text += fmt::format("\t{:+.12f}{:+.12f}i", value, 1e-6 * value);
            }
            text += "\n";
        }
    }
    return text;
}

}  // namespace tricoil::sim
