#include "core/field/general_dipole.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/field/induced_field.hpp"
#include "core/geometry/rotations.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::field {
namespace {

using Model = GeneralDipole<double>;

/// A symmetric polarisability of an object of about 0.1 m.
Mat3<double> random_polarisability(test::RandomPoses& random) {
    const Mat3<double> m = 1e-3 * random.gaussian_matrix();
    return m + m.transpose();
}

/// Source coils with offsets up to 60 mm, sensor coils up to 20 mm, errors of a few degrees and per cent; optionally of finite
/// size, and near metal at 0.15 to 1.5 m.
Model random_model(test::RandomPoses& random, bool finite, bool near_metal = false) {
    Model model;
    for (int j = 0; j < 3; ++j) {
        model.source_offset_m.col(j) = random.uniform(0, 0.06) * random.direction();
        model.sensor_offset_m.col(j) = random.uniform(0, 0.02) * random.direction();
    }
    model.source_moment += 0.05 * random.gaussian_matrix();
    model.sensor_sensitivity += 0.05 * random.gaussian_matrix();
    if (finite) {
        model.source_octupole_m2 = 1e-4 * random.gaussian_vector();
        model.sensor_octupole_m2 = 1e-4 * random.gaussian_vector();
    }
    for (std::size_t d = 0; near_metal && d < kMaxInducedDipoles; ++d) {
        const Vec3<double> place = random.uniform(0.15, 1.5) * random.direction();
        EXPECT_TRUE(model.surroundings.push_back(induced_dipole(model, place, random_polarisability(random))));
    }
    return model;
}

bool is_near_dipole(const Model& model, const Vec3<double>& p) {
    return std::any_of(model.surroundings.begin(), model.surroundings.end(),
                       [&](const InducedDipole<double>& dipole) { return (dipole.position_m - p).norm() < 0.1; });
}

Matrix<double, 9, 6> numeric_jacobian(const Model& model, const Vec3<double>& p, const Quat<double>& q) {
    constexpr double kStep = 5e-4;
    const auto at = [&](const Vec6<double>& d) -> Matrix<double, 9, 1> {
        const Quat<double> turned = geometry::rotation_vector_to_quaternion<double>(d.tail<3>()) * q;
        const Vec3<double> moved = p + d.head<3>();
        return signal_matrix(model, moved, geometry::attitude_matrix(turned)).reshaped();
    };
    Matrix<double, 9, 6> jacobian;
    for (int i = 0; i < 6; ++i) {
        const Vec6<double> d = kStep * Vec6<double>::Unit(i);
        jacobian.col(i) = (8 * (at(d) - at(-d)) - (at(2 * d) - at(-2 * d))) / (12 * kStep);
    }
    return jacobian;
}

TEST(GeneralDipole, EqualsTheConcentricModelForIdealCoils) {
    test::RandomPoses random(31);
    const auto model = Model::concentric(0.7);
    for (int i = 0; i < 200; ++i) {
        const Vec3<double> p = random.uniform(0.15, 1.2) * random.direction();
        const Mat3<double> o = geometry::attitude_matrix(random.attitude());
        for (int j = 0; j < 3; ++j) {
            const auto general = column_model(model, p, o, j);
            const auto ideal = column_model<double>(0.7, p, o, j);
            EXPECT_TRUE(is_approx(general.column, ideal.column, 1e-13));
            EXPECT_TRUE(is_approx(general.by_position_per_m, ideal.by_position_per_m, 1e-12));
            EXPECT_TRUE(is_approx(general.by_rotation_per_rad, ideal.by_rotation_per_rad, 1e-12));
        }
    }
}

TEST(GeneralDipole, MomentsOfConcentricCoilsAreGainMatrices) {
    test::RandomPoses random(32);
    Model model;
    model.source_moment += 0.1 * random.gaussian_matrix();
    model.sensor_sensitivity += 0.1 * random.gaussian_matrix();
    for (int i = 0; i < 50; ++i) {
        const Vec3<double> p = random.uniform(0.2, 1.0) * random.direction();
        const Mat3<double> o = geometry::attitude_matrix(random.attitude());
        const Mat3<double> ideal = signal_matrix<double>(1.0, p, o);
        const Mat3<double> expected = model.sensor_sensitivity.transpose() * ideal * model.source_moment;
        EXPECT_TRUE(is_approx(signal_matrix(model, p, o), expected, 1e-12));
    }
}

TEST(GeneralDipole, OffsetsShiftTheDipole) {
    Model model;
    model.source_offset_m.col(1) = Vec3<double>(0.01, 0.045, -0.02);
    model.sensor_offset_m.col(2) = Vec3<double>(0.005, -0.004, 0.003);
    const Vec3<double> p(0.3, -0.2, 0.1);
    const Mat3<double> o = geometry::attitude_matrix(geometry::Euler<double>{0.4, -0.7, 1.9});
    const Mat3<double> x = signal_matrix(model, p, o);
    const Vec3<double> shifted = p + o.transpose() * model.sensor_offset_m.col(2) - model.source_offset_m.col(1);
    EXPECT_NEAR(x(2, 1), signal_matrix<double>(1.0, shifted, o)(2, 1), 1e-12);
    const Vec3<double> only_source = p - model.source_offset_m.col(1);
    EXPECT_NEAR(x(0, 1), signal_matrix<double>(1.0, only_source, o)(0, 1), 1e-12);
}

TEST(GeneralDipole, JacobianMatchesNumericDifferentiationAlsoAtPolesAndForFiniteCoils) {
    test::RandomPoses random(33);
    const double quarter = std::numbers::pi / 2;
    for (int i = 0; i < 400; ++i) {
        const Model model = random_model(random, i % 2 == 0, i % 4 < 2);
        Vec3<double> p = random.uniform(0.2, 1.2) * random.direction();
        Quat<double> q = random.attitude();
        if (i < 8) {
            p = Vec3<double>(0, 0, i % 2 == 0 ? 0.6 : -0.6);
            const geometry::Euler<double> pole{0.2, i < 4 ? quarter : -quarter, 0.5};
            q = geometry::attitude_quaternion(geometry::attitude_matrix(pole));
        }
        if (is_near_dipole(model, p)) {  // differences of a step of 0.5 mm are too coarse there
            continue;
        }
        const auto analytic = signal_model(model, p, geometry::attitude_matrix(q)).jacobian;
        const auto numeric = numeric_jacobian(model, p, q);
        for (int c = 0; c < 6; ++c) {
            EXPECT_LT((analytic - numeric).col(c).norm(), 1e-7 * analytic.col(c).norm()) << "pose " << i << " column " << c;
        }
    }
}

/// Small sphere: n G(p - c) A G(c - l) m / 2 with G(r) = (3 u u^T - 1) / |r|^3.
TEST(GeneralDipole, SurroundingsAddTheFieldOfInducedDipoles) {
    test::RandomPoses random(35);
    const auto g = [](const Vec3<double>& r) -> Mat3<double> {
        const Vec3<double> u = r.normalized();
        return (3 * u * u.transpose() - Mat3<double>::Identity()) / std::pow(r.norm(), 3);
    };
    for (int i = 0; i < 100; ++i) {
        Model model = random_model(random, false);
        const Vec3<double> p = random.uniform(0.2, 1.0) * random.direction();
        const Vec3<double> place = random.uniform(0.2, 1.0) * random.direction();
        const Mat3<double> o = geometry::attitude_matrix(random.attitude());
        const Mat3<double> polarisability = random_polarisability(random);
        const Mat3<double> clean = signal_matrix(model, p, o);
        EXPECT_TRUE(model.surroundings.push_back(induced_dipole(model, place, polarisability)));
        const Mat3<double> added = signal_matrix(model, p, o) - clean;
        for (int k = 0; k < 9; ++k) {
            const Vec3<double> from = p + o.transpose() * model.sensor_offset_m.col(k / 3) - place;
            const Vec3<double> to = place - model.source_offset_m.col(k % 3);
            const double expected = 0.5 * (o.transpose() * model.sensor_sensitivity.col(k / 3))
                                              .dot(g(from) * polarisability * g(to) * model.source_moment.col(k % 3));
            EXPECT_NEAR(added(k / 3, k % 3), expected, 1e-12 * clean.norm() + 1e-9 * std::abs(expected));
        }
    }
}

TEST(GeneralDipole, SinglePrecisionFollowsDouble) {
    test::RandomPoses random(34);
    for (int i = 0; i < 200; ++i) {
        const Model model = random_model(random, true, true);
        const Vec3<double> p = random.uniform(0.2, 1.2) * random.direction();
        if (is_near_dipole(model, p)) {
            continue;
        }
        const Mat3<double> o = geometry::attitude_matrix(random.attitude());
        const auto exact = signal_model(model, p, o);
        const Vec3<float> p_single = p.cast<float>();
        const Mat3<float> o_single = o.cast<float>();
        const auto single = signal_model(model.cast<float>(), p_single, o_single);
        EXPECT_LT((single.x.cast<double>() - exact.x).norm(), 1e-5 * exact.x.norm());
        EXPECT_LT((single.jacobian.cast<double>() - exact.jacobian).norm(), 1e-5 * exact.jacobian.norm());
    }
}

/// The flux of a dipole through a disc coil, by sampling its area and length, without a series.
double flux_through_coil(const Vec3<double>& centre, const Vec3<double>& axis, double radius, double length,
                         const Vec3<double>& moment) {
    const auto across = geometry::transverse_axes<double>(axis);
    constexpr int kRings = 12;
    constexpr int kAngles = 16;
    constexpr int kSlices = 12;
    double sum = 0;
    for (int ring = 0; ring < kRings; ++ring) {
        const double rho = radius * std::sqrt((ring + 0.5) / kRings);  // equal areas
        for (int a = 0; a < kAngles; ++a) {
            const double angle = 2 * std::numbers::pi * a / kAngles;
            for (int s = 0; s < kSlices; ++s) {
                const double z = length * ((s + 0.5) / kSlices - 0.5);
                const Vec3<double> at =
                    centre + z * axis + rho * (std::cos(angle) * across.col(0) + std::sin(angle) * across.col(1));
                sum += dipole_pair<double>(at, moment, axis).value;
            }
        }
    }
    return sum / (kRings * kAngles * kSlices);
}

TEST(GeneralDipole, OctupoleIsTheNextOrderOfAFiniteCoil) {
    test::RandomPoses random(35);
    const double radius = 0.03;
    const double length = 0.01;
    const double lambda = length * length / 24 - radius * radius / 8;
    for (int i = 0; i < 50; ++i) {
        const Vec3<double> r = 0.3 * random.direction();
        const Vec3<double> axis = random.direction();
        const Vec3<double> moment = random.direction();
        const double truth = flux_through_coil(r, axis, radius, length, moment);
        const double point = dipole_pair<double>(r, moment, axis).value;
        const double scale = 1 / std::pow(r.norm(), 3);
        const double as_sensor = octupole_correction<double>(r, moment, axis, 0.0, lambda).value;
        EXPECT_NEAR(truth, point + as_sensor, 4e-4 * scale);  // the remaining error is of order (size / range)^4
        // Reciprocity: the same coil as a source, seen by a point-like sensor.
        EXPECT_NEAR(octupole_correction<double>(r, axis, moment, lambda, 0.0).value, as_sensor, 1e-12 * scale);
    }
}

/// The parts that trackers of ideal triads use agree with the general model.
TEST(InducedField, AgreesWithTheGeneralModel) {
    test::RandomPoses random(18);
    for (int n = 0; n < 200; ++n) {
        const Model metal = random_model(random, false, true);
        constexpr double kC = 6.75e-3;
        Model ideal = Model::concentric(kC);
        ideal.surroundings = metal.surroundings;
        const Vec3<double> p = random.uniform(0.3, 0.9) * random.direction();
        if (is_near_dipole(ideal, p)) {
            continue;
        }
        const Mat3<double> o = geometry::attitude_matrix(random.attitude());
        for (int j = 0; j < 3; ++j) {
            const auto expected = column_model(ideal, p, o, j);
            auto column = column_model<double>(kC, p, o, j);
            add_induced(ideal.surroundings, p, o, j, column);
            EXPECT_TRUE(is_approx(column.column, expected.column, 1e-12));
            EXPECT_TRUE(is_approx(column.by_position_per_m, expected.by_position_per_m, 1e-12));
            EXPECT_TRUE(is_approx(column.by_rotation_per_rad, expected.by_rotation_per_rad, 1e-12));
        }
        const Mat3<double> x = signal_matrix<double>(kC, p, o) + induced_couplings(ideal.surroundings, p, o);
        EXPECT_TRUE(is_approx(x, signal_matrix(ideal, p, o), 1e-12));
    }
}

}  // namespace
}  // namespace tricoil::field
