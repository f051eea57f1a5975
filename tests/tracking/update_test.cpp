// The filter's algebra against dense matrices and independent differentiation.
#include <gtest/gtest.h>

#include <random>

#include "core/linear/cholesky.hpp"
#include "core/linear/eigen.hpp"
#include "core/tracking/scaat/acquisition.hpp"
#include "core/tracking/scaat/column_update.hpp"
#include "core/tracking/scaat/propagate.hpp"

namespace tricoil::tracking::scaat {
namespace {

constexpr ConcentricMeasurement<double> kModel{6.75e-3};

Mat12<double> random_covariance(std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    const Mat12<double> a = Mat12<double>::NullaryExpr([&] { return normal(random); });
    return 1e-4 * (a * a.transpose()) + 1e-5 * Mat12<double>::Identity();
}

State<double> random_state(std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    const auto vec = [&] { return Vec3<double>(normal(random), normal(random), normal(random)); };
    State<double> s;
    s.position_m = 0.5 * vec().normalized();
    s.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(2 * vec());
    s.velocity_m_s = vec();
    s.rate_rad_s = 5 * vec();
    s.covariance = random_covariance(random);
    return s;
}

TEST(Propagate, CovarianceEqualsTheDenseProduct) {
    std::mt19937_64 random(11);
    const Mat12<double> p = random_covariance(random);
    const double dt = 0.02;
    Mat12<double> f = Mat12<double>::Identity();
    f.topRightCorner<6, 6>() = dt * Mat6<double>::Identity();
    Mat12<double> q = Mat12<double>::Zero();
    for (int i = 0; i < 6; ++i) {
        const double intensity = i < 3 ? 0.7 : 30.0;
        q(i, i) = intensity * dt * dt * dt / 3;
        q(i, i + 6) = q(i + 6, i) = intensity * dt * dt / 2;
        q(i + 6, i + 6) = intensity * dt;
    }
    Mat12<double> grown = p;
    grow_covariance<double>(grown, {0.7, 30.0}, dt);
    EXPECT_LT((grown - (f * p * f.transpose() + q)).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_EQ((grown - grown.transpose()).cwiseAbs().maxCoeff(), 0);
}

TEST(Propagate, TurnsExactlyThroughManyTurns) {
    State<double> s;
    s.rate_rad_s = {0, 0, 20};
    s.velocity_m_s = {1, -2, 3};
    for (int n = 1; n <= 720; ++n) {
        propagate<double>(s, {}, device_time_us(n * 1000));
    }
    EXPECT_LT((s.position_m - 0.72 * Vec3<double>(1, -2, 3)).norm(), 1e-12);
    EXPECT_LT(geometry::angle_between(s.q_source_sensor, geometry::rotation_vector_to_quaternion<double>({0, 0, 14.4})), 1e-12);
}

/// Jacobian of the innovation against numeric differentiation in all twelve error directions: columns on time and late, at poles
/// and with small angles.
TEST(Innovation, JacobianEqualsNumericDifferentiation) {
    std::mt19937_64 random(12);
    std::vector<State<double>> states;
    for (int n = 0; n < 20; ++n) {
        states.push_back(random_state(random));
    }
    states[0].position_m = {0, 0, -0.5};  // beta = +90 deg
    states[1].q_source_sensor = Quat<double>::Identity();
    states[2].q_source_sensor = geometry::rotation_vector_to_quaternion<double>({0, 3.14159265358979323846 / 2, 0});
    states[3].rate_rad_s.setZero();
    for (const auto& state : states) {
        for (const double late : {0.0, 0.005}) {
            for (int j = 0; j < 3; ++j) {
                const Vec3<double> z(0.01, 0.02, 0.03);
                const auto here = innovation<double>(kModel, state, state, j, z, late);
                Matrix<double, 3, 12> h;
                h << here.h, -late * here.h;
                for (int i = 0; i < kErrorStates; ++i) {
                    const double step = 1e-6;
                    const auto at = [&](double sign) {
                        State<double> moved = state;
                        correct<double>(moved, sign * step * Vec12<double>::Unit(i));
                        return innovation<double>(kModel, moved, moved, j, z, late).y;
                    };
                    const Vec3<double> numeric = -(at(1) - at(-1)) / (2 * step);
                    // The block of the rates neglects half the turn w dt of a late column: up to 15 rad/s times 5 ms.
                    const double allowed = i >= 9 && late > 0 ? 0.05 * h.rightCols<3>().norm() : 1e-7;
                    EXPECT_LT((numeric - h.col(i)).norm(), allowed) << "state " << i << " column " << j << " late " << late;
                }
            }
        }
    }
}

TEST(Update, EqualsTheInformationForm) {
    std::mt19937_64 random(13);
    State<double> state = random_state(random);
    const Mat12<double> before = state.covariance;
    const Vec3<double> r(1e-8, 2e-8, 3e-8);
    auto y = innovation<double>(kModel, state, state, 1, {0.02, 0.01, 0}, 0);
    y.set_noise(r);
    ASSERT_TRUE(y.ok);
    Matrix<double, 3, 12> h = Matrix<double, 3, 12>::Zero();
    h.leftCols<6>() = y.h;
    apply(state, y);
    const Mat12<double> information = Mat12<double>(eigen(before).inverse()) + h.transpose() * r.cwiseInverse().asDiagonal() * h;
    EXPECT_LT((state.covariance * information - Mat12<double>::Identity()).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ((state.covariance - state.covariance.transpose()).cwiseAbs().maxCoeff(), 0);
}

/// Repeated columns with much less noise than the prediction, in float, from a large covariance: P must stay positive definite.
TEST(Update, FloatKeepsTheCovariancePositiveDefinite) {
    std::mt19937_64 random(14);
    const ConcentricMeasurement<float> model{6.75e-3F};
    State<float> state;
    state.position_m = {0.5F, 0.1F, -0.2F};
    state.covariance = Vec12<float>::Constant(1e-4F).asDiagonal();
    for (int n = 0; n < 3000; ++n) {
        grow_covariance<float>(state.covariance, {1e-3F, 0.3F}, 1.0F / 720);
        const Vec3<float> z = model.column(state.position_m, state.q_source_sensor.toRotationMatrix().transpose(), n % 3).column;
        Column<float> column;
        column.state = single_coil(n % 3);
        column.in_phase = z;
        column.sigma.setConstant(1e-8F);  // only the quantisation of the converter
        const auto y = column_innovation<float>(model, state, state, column, {});
        ASSERT_TRUE(y.ok) << n;
        apply(state, y);
        const Cholesky<double, 12> factor(state.covariance.cast<double>());
        ASSERT_TRUE(factor.ok()) << "column " << n;
    }
}

}  // namespace
}  // namespace tricoil::tracking::scaat
