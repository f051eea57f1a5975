// Phases and quadrature of clean couplings, against the phases that were put in and the tracker's own judgement.
#include "board/host/calibration/coupling_phases.hpp"

#include <gtest/gtest.h>

#include "board/host/calibration/frame_file.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/linear/eigen.hpp"
#include "core/tracking/judge/quadrature_check.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::host {
namespace {

CouplingFrame turned(const Mat3<double>& x, const Mat3<double>& phase_rad) {
    return {(eigen(x).array() * eigen(phase_rad).array().cos()).matrix(),
            (eigen(x).array() * eigen(phase_rad).array().sin()).matrix()};
}

/// At ranges of 0.3 to 0.9 m.
std::vector<Mat3<double>> random_couplings(std::size_t count, std::uint64_t seed) {
    test::RandomPoses random(seed);
    std::vector<Mat3<double>> couplings;
    for (std::size_t n = 0; n < count; ++n) {
        const Vec3<double> position_m = random.uniform(0.3, 0.9) * random.direction();
        couplings.push_back(field::signal_matrix<double>(1.0, position_m, random.attitude().toRotationMatrix()));
    }
    return couplings;
}

std::vector<CouplingFrame> turned(const std::vector<Mat3<double>>& couplings, const Mat3<double>& phase_rad) {
    std::vector<CouplingFrame> frames;
    for (const Mat3<double>& x : couplings) {
        frames.push_back(turned(x, phase_rad));
    }
    return frames;
}

/// Milliradians between the couplings of one channel, as on the recorded source.
const Mat3<double> kOwn = 1e-3 * (Mat3<double>() << 0.1, -4.9, 4.7, 3.5, -0.4, 10.2, -1.8, -7.9, -0.1).finished();

/// Phases of the channels near 0, 90 and -45 degrees.
TEST(CouplingPhases, AreThoseOfEachCoupling) {
    Mat3<double> phase_rad = kOwn;
    phase_rad.colwise() += Vec3<double>(0.2, M_PI / 2, -M_PI / 4);
    const auto couplings = random_couplings(200, 11);
    auto frames = turned(couplings, phase_rad);
    const Mat3<double> found = phases_of(frames);
    // A channel's phase is known up to half a turn: all three couplings change their sign with it.
    for (int i = 0; i < 3; ++i) {
        const double half_turns = M_PI * std::round((phase_rad(i, 0) - found(i, 0)) / M_PI);
        for (int j = 0; j < 3; ++j) {
            EXPECT_NEAR(found(i, j) + half_turns, phase_rad(i, j), 1e-12) << i << ' ' << j;
        }
    }
    calibration::Calibration<double> coils;
    coils.phase_rad = found;
    remove_phases_of(frames, coils);
    for (std::size_t n = 0; n < frames.size(); ++n) {
        EXPECT_LT((frames[n].x.cwiseAbs() - couplings[n].cwiseAbs()).norm(), 1e-12 * couplings[n].norm());
        EXPECT_LT(frames[n].quadrature->norm(), 1e-12 * couplings[n].norm());
    }
}

/// On the axis of the source only the diagonal couples. Crosstalk in quadrature must not become a phase of 90 degrees.
TEST(CouplingPhases, OfCouplingsThatAreAlwaysSmallAreThoseOfTheChannel) {
    for (const double crosstalk : {0.001, 0.01, 0.03, 0.1}) {
        std::vector<CouplingFrame> frames;
        for (const double range_m : {0.3, 0.5, 0.7}) {
            const Mat3<double> x = field::signal_matrix<double>(1.0, range_m * Vec3<double>::UnitX(), Mat3<double>::Identity());
            frames.push_back(turned(x, Mat3<double>::Constant(0.1)));
            frames.back().quadrature->operator()(0, 1) += crosstalk * x(0, 0);
        }
        EXPECT_LT((phases_of(frames) - Mat3<double>::Constant(0.1)).cwiseAbs().maxCoeff(), 0.01) << crosstalk;
    }
}

TEST(CouplingPhases, AreUnknownUnlessEveryRowHasAQuadrature) {
    auto frames = turned(random_couplings(20, 3), kOwn);
    EXPECT_FALSE(phases_of(frames).isZero(0));
    EXPECT_EQ(quadrature_shares({}, frames).size(), 20U);
    frames[7].quadrature.reset();
    EXPECT_TRUE(phases_of(frames).isZero(0));
    EXPECT_TRUE(quadrature_shares({}, frames).empty());
    for (CouplingFrame& frame : frames) {
        frame.quadrature = Mat3<double>::Zero();  // a format with quadratures, from a device without them
    }
    EXPECT_TRUE(quadrature_shares({}, frames).empty());
}

TEST(QuadratureFloor, IsUnknownFromFewPosesAndLeavesOutOutliers) {
    std::vector<double> shares(18, 1e-3);
    EXPECT_EQ(quadrature_floor_of({}), 1);
    EXPECT_EQ(quadrature_floor_of({shares.begin(), shares.end() - 1}), 1);
    shares[3] = 4e-3;
    EXPECT_DOUBLE_EQ(quadrature_floor_of(shares), 4e-3 / std::sqrt(6));
    shares[5] = 9e-3;
    EXPECT_DOUBLE_EQ(quadrature_floor_of(shares), 4e-3 / std::sqrt(6));
}

/// Coils with gains of 1 : 2 : 3. The tracker judges corrected couplings, so the share must be that of these.
TEST(QuadratureFloor, IsThatOfTheTrackersCouplings) {
    calibration::Calibration<double> coils;
    coils.model.source_moment.diagonal() << 1, 2, 3;
    coils.model.sensor_sensitivity.diagonal() << 3, 1, 2;
    constexpr double kQuadrature = 1e-3;
    for (const Mat3<double>& ideal : random_couplings(20, 5)) {
        const Mat3<double> gains = coils.model.sensor_sensitivity.diagonal() * coils.model.source_moment.diagonal().transpose();
        const Mat3<double> quadrature = Mat3<double>::Constant(kQuadrature * ideal.norm() / 3);
        const double share = quadrature_share(*calibration::CoilCorrection<double>::ideal_triads(coils),
                                              ideal.cwiseProduct(gains), quadrature.cwiseProduct(gains));
        EXPECT_NEAR(share, kQuadrature, 1e-8);
    }
}

/// No pose of the calibration is flagged, nor any with 1.9 times the largest quadrature of these; twice that quadrature is.
TEST(QuadratureFloor, IsJudgedByTheTracker) {
    constexpr double kShare = 2e-3;
    const double floor = quadrature_floor_of(std::vector<double>(18, kShare));
    tracking::CommonParams<double> params;
    params.quadrature_floor = floor;
    const Mat3<double> x = field::signal_matrix<double>(1.0, 0.5 * Vec3<double>::UnitZ(), Mat3<double>::Identity());
    for (const double share : {kShare, 1.9 * kShare, 2 * kShare}) {
        tracking::SignalMatrix<double> matrix;
        matrix.quadrature_squared = share * share * x.squaredNorm();
        tracking::QuadratureCheck<double> check;
        const bool flagged =
            check.add(matrix, field::coupling_strength(1.0, 0.5), tracking::ColumnMotion<double>(params), params);
        EXPECT_EQ(flagged, share > 1.95 * kShare) << share;
        EXPECT_EQ(exceeds_quadrature_floor(share, floor), flagged) << share;
    }
}

}  // namespace
}  // namespace tricoil::host
