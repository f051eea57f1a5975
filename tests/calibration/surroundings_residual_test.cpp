// Derivatives of the residual near metal against central differences (ceres::GradientChecker).
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include <random>

#include "board/host/calibration/surroundings_residual.hpp"

namespace tricoil::host {
namespace {

Mat3<double> turned(double x, double y, double z) { return rotation_of(std::array{x, y, z}.data()); }

TEST(SurroundingsResidual, DerivativesEqualCentralDifferences) {
    std::mt19937 random(20261124);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int n = 0; n < 20; ++n) {
        auto coils = field::GeneralDipole<double>::concentric(0.02);
        for (int k = 0; k < 9; ++k) {
            coils.source_moment.data()[k] += 1e-3 * unit(random);
            coils.sensor_sensitivity.data()[k] += 0.05 * unit(random);
            coils.source_offset_m.data()[k] = 0.02 * unit(random);
            coils.sensor_offset_m.data()[k] = 0.005 * unit(random);
        }
        const PlacedCouplings placed{{0.35, -0.1, 0.15}, turned(0.2, -0.5, 1.1), 0.1 * turned(0.5, 0.1, -0.7)};
        const FrameStarts starts{turned(0.1, 0.2, 0.3), turned(-1, 0.4, 0.2)};
        const int dipoles = n % 3;
        const SurroundingsResidual residual(coils, placed, starts,
                                            Matrix<double, 9, 9>::Identity() + 0.1 * Matrix<double, 9, 9>::Ones(), dipoles);
        RigidBlock frame{};
        RigidBlock mount{};
        std::array<double, kTurn> turn{};
        std::vector<double> metal;
        for (auto* numbers : {frame.data(), mount.data()}) {
            for (int k = 0; k < kRigid; ++k) {
                numbers[k] = n == 0 ? 0 : 0.3 * unit(random);
            }
        }
        for (double& number : turn) {
            number = n == 0 ? 0 : 0.4 * unit(random);
        }
        for (int d = 0; d < dipoles; ++d) {
            metal.insert(metal.end(), {2 + unit(random), unit(random), -5 + unit(random)});
            for (int k = 3; k < kDipole; ++k) {
                metal.push_back(5 * unit(random));
            }
        }
        std::vector<double*> blocks{frame.data(), mount.data(), turn.data()};
        if (dipoles > 0) {
            blocks.push_back(metal.data());
        }
        const std::vector<const ceres::Manifold*> manifolds(blocks.size(), nullptr);
        const ceres::GradientChecker checker(&residual, &manifolds, ceres::NumericDiffOptions());
        ceres::GradientChecker::ProbeResults results;
        EXPECT_TRUE(checker.Probe(blocks.data(), 1e-6, &results)) << n << results.error_log;
    }
}

}  // namespace
}  // namespace tricoil::host
