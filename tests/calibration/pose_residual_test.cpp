// Derivatives of the calibration's residual against central differences (ceres::GradientChecker).
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include <random>

#include "board/host/calibration/pose_residual.hpp"

namespace tricoil::host {
namespace {

struct Blocks {
    std::array<double, kMagnetic> magnetic{};
    RigidBlock source{}, fixture{}, jig{};
    std::array<double, kStage> stage{};
    std::array<double, kPickUp> pick_up{};

    std::vector<double*> all() {
        return {magnetic.data(), source.data(), fixture.data(), jig.data(), stage.data(), pick_up.data()};
    }
};

/// Coils 5 % unequal, offsets to 20 mm, octupoles to 300 mm^2, small rotations; `scale` 0 leaves all rotation vectors zero.
Blocks random_blocks(std::mt19937& random, double scale) {
    std::uniform_real_distribution<double> unit(-1, 1);
    Blocks b;
    for (int k = 0; k < kMagnetic; ++k) {
        const double spread = k < kSourceOffsets ? 0.05 : k < kOctupoles ? 0.2 : 0.03;
        b.magnetic[static_cast<std::size_t>(k)] = spread * unit(random);
    }
    for (const int diagonal : {0, 1, 2, kSensitivities, kSensitivities + 1}) {
        b.magnetic[static_cast<std::size_t>(diagonal)] += 1;
    }
    for (RigidBlock* block : {&b.source, &b.fixture, &b.jig}) {
        for (std::size_t k = 0; k < kRigid; ++k) {
            (*block)[k] = (k < 3 ? 0.3 : 0.4 * scale) * unit(random);
        }
    }
    std::generate(b.pick_up.begin(), b.pick_up.end(), [&] { return 3 * unit(random); });
    for (std::size_t k = 0; k < kStage; ++k) {
        b.stage[k] = (k < kStray ? 0.05 : 3) * unit(random);
    }
    return b;
}

Mat3<double> rotation_about(double x, double y, double z) { return rotation_of(std::array{x, y, z}.data()); }

void expect_derivatives(Blocks b, bool finite) {
    MeasuredPose pose;
    pose.stage_position_m = {0.35, -0.1, 0.15};
    pose.stage_rotation = rotation_about(0.2, -0.5, 1.1);
    pose.x = 0.1 * rotation_about(0.5, 0.1, -0.7);
    const PoseTerms terms{pose,
                          rotation_about(0.1, 0.2, 0.3),
                          rotation_about(-1, 0.4, 0.2),
                          rotation_about(0.7, -0.3, 0.5),
                          0.02,
                          Matrix<double, 9, 9>::Identity() + 0.1 * Matrix<double, 9, 9>::Ones(),
                          finite};
    const PoseResidual residual(terms);
    const std::vector<const ceres::Manifold*> manifolds(6, nullptr);
    const ceres::GradientChecker checker(&residual, &manifolds, ceres::NumericDiffOptions());
    ceres::GradientChecker::ProbeResults results;
    std::vector<double*> blocks = b.all();
    EXPECT_TRUE(checker.Probe(blocks.data(), 1e-6, &results)) << results.error_log;
}

TEST(PoseResidual, DerivativesEqualCentralDifferences) {
    std::mt19937 random(20261122);
    for (int n = 0; n < 20; ++n) {
        expect_derivatives(random_blocks(random, 1), true);
        Blocks dipoles = random_blocks(random, 1);
        std::fill(dipoles.magnetic.begin() + kOctupoles, dipoles.magnetic.end(), 0.0);
        expect_derivatives(dipoles, false);
    }
}

TEST(PoseResidual, DerivativesHoldAtZeroRotation) {
    std::mt19937 random(7);
    expect_derivatives(random_blocks(random, 0), true);
}

}  // namespace
}  // namespace tricoil::host
