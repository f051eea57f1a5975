#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>

#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/solver/refine.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

using Model = field::GeneralDipole<double>;

/// Source coils 45 mm from each other, 26 mm from their middle; sensor coils slightly displaced, with gain and angle errors.
Model wide_model() {
    test::RandomPoses random(50);
    Model model;
    for (int j = 0; j < 3; ++j) {
        model.source_offset_m.col(j) = 0.045 / std::sqrt(2.0) * (Vec3<double>::Unit(j) - Vec3<double>::Constant(1.0 / 3));
    }
    model.source_moment += 0.03 * random.gaussian_matrix();
    model.sensor_sensitivity += 0.03 * random.gaussian_matrix();
    model.sensor_offset_m = 0.001 * random.gaussian_matrix();
    return model;
}

Mat3<double> couplings(const Model& model, const Vec3<double>& p, const Quat<double>& q) {
    return field::signal_matrix<double>(model, p, geometry::attitude_matrix(q));
}

const Mat3<double> kEqual = Mat3<double>::Ones();

/// Residuals for Ceres of the pose `start`, displaced by d = (position, small rotation).
class CeresResidual final : public ceres::SizedCostFunction<9, 6> {
public:
    CeresResidual(const Model& model, const Mat3<double>& x, const RigidPose<double>& start)
        : model_(model), x_(x), start_(start) {}
    bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
        const Vec6<double> d = Vec6<double>(parameters[0]);
        const auto value = [&](const Vec6<double>& at) -> Matrix<double, 9, 1> {
            const Vec3<double> p = start_.position_m + at.head<3>();
            const Vec3<double> r = at.tail<3>();
            return (couplings(model_, p, geometry::rotation_vector_to_quaternion<double>(r) * start_.q_source_sensor) - x_)
                .reshaped();
        };
        copy_rows(value(d), residuals);
        if (jacobians != nullptr && jacobians[0] != nullptr) {  // numeric, so that it is independent of the derivation under test
            Eigen::Map<Eigen::Matrix<double, 9, 6, Eigen::RowMajor>> jacobian(jacobians[0], 9, 6);
            constexpr double kStep = 1e-5;
            for (int i = 0; i < 6; ++i) {
                const Vec6<double> step = kStep * Vec6<double>::Unit(i);
                const Matrix<double, 9, 1> difference = value(d + step) - value(d - step);
                jacobian.col(i) = eigen(difference / (2 * kStep));
            }
        }
        return true;
    }

private:
    const Model& model_;
    const Mat3<double>& x_;
    const RigidPose<double>& start_;
};

/// Least-squares position by Ceres, started at the truth.
Vec3<double> ceres_position(const Model& model, const Mat3<double>& x, const RigidPose<double>& truth) {
    Vec6<double> d = Vec6<double>::Zero();
    ceres::Problem problem;
    problem.AddResidualBlock(new CeresResidual(model, x, truth), nullptr, d.data());
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = 1e-15;
    options.gradient_tolerance = 1e-15;
    options.parameter_tolerance = 1e-12;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    return truth.position_m + d.head<3>();
}

TEST(Refine, NeedsAtMostThreeIterationsFromThePreviousPoseAt240Hertz) {
    const Model model = wide_model();
    int most = 0;
    int poses = 0;
    double worst_m = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        const sim::HandMotion motion({0.45, 0.1, -0.1}, seed);
        sim::Pose previous = motion.at(0);
        for (int k = 1; k <= 240 * 10; ++k) {
            const sim::Pose now = motion.at(k / 240.0);
            if (previous.position_m.norm() > 0.2 && now.position_m.norm() > 0.2) {
                const auto r = refine<double>(model, couplings(model, now.position_m, now.q_source_sensor), kEqual,
                                              {previous.position_m, previous.q_source_sensor});
                ASSERT_TRUE(r.ok());
                EXPECT_TRUE(r->converged()) << "seed " << seed << " pose " << k;
                most = std::max(most, r->iterations);
                worst_m = std::max(worst_m, (r->pose.position_m - now.position_m).norm());
                ++poses;
            }
            previous = now;
        }
    }
    std::cout << poses << " poses: at most " << most << " iterations, worst error " << worst_m << " m\n";
    EXPECT_GT(poses, 15'000);
    EXPECT_LE(most, 3);
    EXPECT_LT(worst_m, 1e-6);
}

struct ColdRates {
    double converged = 0;     // share of poses
    double within_seven = 0;  // share of poses found with at most seven iterations, summed over all starts
    int wrong = 0;            // reported as converged at a wrong pose
    int most = 0;
};

ColdRates cold_rates(double from_m, double to_m, int poses, bool know_hemisphere) {
    const Model model = wide_model();
    test::RandomPoses random(51);
    ColdRates rates;
    for (int i = 0; i < poses; ++i) {
        const Vec3<double> p = random.uniform(from_m, to_m) * random.direction();
        const Quat<double> q = random.attitude();
        ColdStartParams<double> params;
        params.hemisphere = know_hemisphere ? p : Vec3<double>::Zero();
        const auto s = solve_cold<double>(model, couplings(model, p, q), kEqual, params);
        EXPECT_TRUE(s.ok());
        const bool converged = s->refinement.converged();
        const bool right = (s->refinement.pose.position_m - p).norm() < 1e-6;
        rates.converged += converged && right ? 1.0 / poses : 0;
        rates.within_seven += converged && right && s->iterations <= 7 ? 1.0 / poses : 0;
        rates.wrong += converged && !right ? 1 : 0;
        rates.most = std::max(rates.most, s->iterations);
    }
    std::cout << from_m << "-" << to_m << " m, seed 51, hemisphere " << (know_hemisphere ? "known" : "unknown") << ": converged "
              << 100 * rates.converged << " %, within 7 iterations " << 100 * rates.within_seven << " %, wrong " << rates.wrong
              << ", most iterations " << rates.most << "\n";
    return rates;
}

/// Coils farther apart than those above. Every pose has a direction in the half space, but not always one near the direct
/// solution.
TEST(ColdStart, FindsEveryPoseFromTwoSpacings) {
    test::RandomPoses random(52);
    int starts = 0;
    for (int i = 0; i < 20'000; ++i) {
        const double spacing_m = random.uniform(0.02, 0.08);
        Model model = wide_model();
        model.source_offset_m *= spacing_m / 0.045;
        const Vec3<double> p = spacing_m * random.uniform(2, 3) * random.direction();
        const Quat<double> q = random.attitude();
        ColdStartParams<double> params;
        params.hemisphere = p;
        params.refine.max_iterations = 40;
        params.refine.max_condition = 1e9;  // also poses that noise would make uncertain
        const auto s = solve_cold<double>(model, couplings(model, p, q), kEqual, params);
        ASSERT_TRUE(s.ok());
        EXPECT_TRUE(s->refinement.converged()) << i;
        EXPECT_LT((s->refinement.pose.position_m - p).norm(), 1e-5) << i;
        starts = std::max(starts, s->starts);
    }
    EXPECT_LE(starts, 8);
}

TEST(ColdStart, ReachesThePoseInSevenIterations) {
    for (const bool known : {true, false}) {
        const ColdRates far = cold_rates(0.3, 1.2, 10'000, known);
        EXPECT_GE(far.within_seven, 0.999);
        EXPECT_EQ(far.wrong, 0);
        const ColdRates middle = cold_rates(0.2, 0.3, 10'000, known);
        EXPECT_GE(middle.converged, 0.999);
        EXPECT_EQ(middle.wrong, 0);
    }
}

TEST(ColdStart, NearTheCoilsNeverReportsAWrongMinimum) {
    for (const bool known : {true, false}) {
        const ColdRates near = cold_rates(0.15, 0.2, 10'000, known);
        EXPECT_GE(near.converged, 0.999);
        EXPECT_EQ(near.wrong, 0);
    }
    const ColdRates nearest = cold_rates(0.1, 0.15, 10'000, false);
    EXPECT_GE(nearest.converged, 0.99);
    EXPECT_EQ(nearest.wrong, 0);
}

TEST(ColdStart, ConvergesInSinglePrecision) {
    const auto model = wide_model().cast<float>();
    test::RandomPoses random(52);
    int converged = 0;
    constexpr int kPoses = 3000;
    for (int i = 0; i < kPoses; ++i) {
        const Vec3<double> p = random.uniform(0.2, 1.2) * random.direction();
        const Mat3<double> x = couplings(wide_model(), p, random.attitude());
        const auto s = solve_cold<float>(model, x.cast<float>(), Mat3<float>::Ones());
        ASSERT_TRUE(s.ok());
        const double error = (s->refinement.pose.position_m.cast<double>() - p).norm();
        converged += s->refinement.converged() && error < 3e-5 * p.norm() ? 1 : 0;
    }
    EXPECT_GE(converged, kPoses - 3);
}

TEST(Refine, EqualsCeresWithAndWithoutNoise) {
    const Model model = wide_model();
    test::RandomPoses random(53);
    double worst_m = 0;
    for (int i = 0; i < 1000; ++i) {
        const Vec3<double> p = random.uniform(0.2, 1.0) * random.direction();
        const Quat<double> q = random.attitude();
        const Mat3<double> clean = couplings(model, p, q);
        const double sigma = i % 2 == 0 ? 0 : 1e-3 * clean.norm();
        const Mat3<double> x = clean + sigma * random.gaussian_matrix();
        ColdStartParams<double> params;
        params.hemisphere = p;
        const auto s = solve_cold<double>(model, x, kEqual, params);
        ASSERT_TRUE(s.ok() && s->refinement.converged());
        worst_m = std::max(worst_m, (s->refinement.pose.position_m - ceres_position(model, x, {p, q})).norm());
    }
    std::cout << "largest distance to Ceres' pose " << worst_m << " m\n";
    EXPECT_LT(worst_m, 1e-6);
}

TEST(Refine, EqualsTheDirectSolutionOnIdealTriads) {
    test::RandomPoses random(54);
    const auto model = Model::concentric(1.0);
    for (int i = 0; i < 200; ++i) {
        const Vec3<double> p = random.uniform(0.2, 1.0) * random.direction();
        const Quat<double> q = random.attitude();
        const double k = 1 / std::pow(p.norm(), 3);
        const double sigma = 1e-3 * k;
        const Mat3<double> x = couplings(model, p, q) + sigma * random.gaussian_matrix();
        const auto direct = solve_direct<double>(x, 1.0);
        const auto refined = refine<double>(model, x, Mat3<double>::Constant(1 / sigma), {p, q});
        ASSERT_TRUE(direct.ok() && refined.ok());
        const double side = direct->direction.dot(p) < 0 ? -1 : 1;
        EXPECT_LT((side * direct->range_m * direct->direction - refined->pose.position_m).norm(), 1e-6 * p.norm());
        const Vec3<double> u = refined->pose.position_m.normalized();
        const Mat6<double> bound =
            pose_covariance<double>(1 / std::pow(refined->pose.position_m.norm(), 3), refined->pose.position_m.norm(), u, sigma);
        EXPECT_LT((refined->covariance - bound).norm(), 0.01 * bound.norm());
    }
}

TEST(Refine, ZeroWeightExcludesAnEntry) {
    const Model model = wide_model();
    const Vec3<double> p(0.35, 0.2, -0.1);
    const Quat<double> q = Quat<double>(0.8, 0.2, -0.4, 0.3).normalized();
    Mat3<double> x = couplings(model, p, q);
    x(1, 2) *= 1.5;  // one wrong entry
    Mat3<double> weights = Mat3<double>::Ones();
    const auto unweighted = refine<double>(model, x, weights, {p, q});
    weights(1, 2) = 0;
    const auto weighted = refine<double>(model, x, weights, {p, q});
    ASSERT_TRUE(unweighted.ok() && weighted.ok());
    EXPECT_GT((unweighted->pose.position_m - p).norm(), 1e-3);
    EXPECT_TRUE(weighted->converged());
    EXPECT_LT((weighted->pose.position_m - p).norm(), 1e-9);
}

TEST(Refine, ReportsNonConvergence) {
    const Model model = wide_model();
    const Vec3<double> p(0.35, 0.2, -0.1);
    const Mat3<double> x = couplings(model, p, Quat<double>::Identity());
    RefineParams<double> one;
    one.max_iterations = 1;
    const auto stopped = refine<double>(model, x, kEqual, {1.3 * p, Quat<double>::Identity()}, one);
    EXPECT_EQ(stopped->end, RefineEnd::iteration_limit);
    EXPECT_EQ(stopped->iterations, 1);
    // Couplings that no dipole explains: the minimum has a large residual.
    test::RandomPoses random(55);
    const auto nonsense = solve_cold<double>(model, x.norm() * random.gaussian_matrix(), kEqual);
    EXPECT_FALSE(nonsense->refinement.converged());
    // One source coil does not determine six parameters.
    Mat3<double> weights = Mat3<double>::Zero();
    weights.col(0).setConstant(1);
    const auto blind = refine<double>(model, x, weights, {p, Quat<double>::Identity()});
    EXPECT_NE(blind->end, RefineEnd::converged);
    EXPECT_GT(blind->condition, 1e6);
    Mat3<double> bad = x;
    bad(0, 0) = std::nan("");
    EXPECT_EQ(refine<double>(model, bad, kEqual, {p, Quat<double>::Identity()}).status().code(), StatusCode::not_finite);
    EXPECT_EQ(refine<double>(model, x, Mat3<double>::Zero(), {p, Quat<double>::Identity()}).status().code(),
              StatusCode::degenerate);
}

TEST(ColdStart, ReportsAReversedCoil) {
    const Model model = wide_model();
    Mat3<double> x = couplings(model, {0.4, 0.1, -0.3}, Quat<double>(0.9, 0.1, -0.3, 0.2).normalized());
    EXPECT_TRUE(solve_cold<double>(model, x, kEqual)->right_handed);
    x.col(1) *= -1;
    EXPECT_FALSE(solve_cold<double>(model, x, kEqual)->right_handed);
}

}  // namespace
}  // namespace tricoil::solver
