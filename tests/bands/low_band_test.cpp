// Plan and demodulator of the low band.
#include "core/signal/low_band.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "sim/motion/simple_motions.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::signal {
namespace {

AcquisitionPlan fdm_plan(double frame_rate_hz) {
    return *plan_acquisition(default_acquisition(Multiplexing::fdm, frame_rate_hz));
}

TEST(LowBandPlan, TonesAreMultiplesOfTheFrameRate) {
    const auto plan = plan_low_band(fdm_plan(240));
    ASSERT_TRUE(plan.ok());
    EXPECT_DOUBLE_EQ(plan->tone_hz(0), 480);
    EXPECT_DOUBLE_EQ(plan->tone_hz(1), 720);
    EXPECT_DOUBLE_EQ(plan->tone_hz(2), 960);
    EXPECT_EQ(plan->window_blocks, 10);
    EXPECT_EQ(plan->hop_blocks(), 5);
}

TEST(LowBandPlan, TonesDifferAndStayWithinTheirLimits) {
    for (const double rate_hz : {150.0, 160.0, 200.0, 240.0, 288.0, 300.0, 320.0}) {
        const auto plan = plan_low_band(fdm_plan(rate_hz));
        ASSERT_TRUE(plan.ok()) << rate_hz;
        EXPECT_GE(plan->tone_hz(0), LowBandPlan::kMin_hz - 1e-6) << rate_hz;
        EXPECT_LT(plan->tone_hz(0), plan->tone_hz(1)) << rate_hz;
        EXPECT_LT(plan->tone_hz(1), plan->tone_hz(2)) << rate_hz;
        EXPECT_LE(plan->tone_hz(2), LowBandPlan::kMax_hz + 1e-6) << rate_hz;
        EXPECT_LE(plan->window_blocks, LowBandPlan::kMaxWindowBlocks) << rate_hz;
    }
}

TEST(LowBandPlan, RefusesTdmAndHighFrameRates) {
    const auto tdm = plan_low_band(*plan_acquisition(default_acquisition(Multiplexing::tdm, 240)));
    EXPECT_THAT(tdm.status().message(), ::testing::HasSubstr("FDM"));
    EXPECT_THAT(plan_low_band(fdm_plan(480)).status().message(), ::testing::HasSubstr("333 frames"));
}

struct Recorded {
    sim::CoilWorld world;
    std::vector<LowBandMatrix> matrices;
};

/// Half a second of samples. skipped: index of a block that does not reach the demodulator.
Recorded run(const sim::Motion& motion, const sim::WorldParams& params, int skipped = -1) {
    const AcquisitionPlan plan = fdm_plan(240);
    Recorded result{sim::CoilWorld(params, motion, {}), {}};
    result.world.transmit_low_band(*plan_low_band(plan));
    result.world.configure(plan);
    LowBandDemodulator demodulator(plan, result.world.low_band_demodulation());
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    for (int n = 0; n < 120; ++n) {
        SampleBlock block;
        block.state = Excitation::all;
        block.scale = static_cast<float>(result.world.volts_per_code());
        block.full_scale = result.world.full_scale();
        block.start = DeviceTime{microseconds_from_seconds(n * plan.block_s())};
        block.samples = samples;
        result.world.sample(Excitation::all, n * plan.block_s(), samples);
        if (n == 0 || n == skipped) {  // the first block contains the switching transient
            continue;
        }
        if (const auto matrix = demodulator.add(block, true)) {
            result.matrices.push_back(*matrix);
        }
    }
    return result;
}

const sim::Pose kPose{{0.4, 0.1, 0.05}, geometry::rotation_vector_to_quaternion(Vec3<double>(0.3, -0.5, 0.2))};

TEST(LowBandDemodulator, GivesTheCouplingsOfARestingSensorDespiteMainsHum) {
    const sim::StillMotion motion(kPose);
    sim::WorldParams params;
    params.converter.noise_v_per_sqrt_hz = 0;
    const Recorded r = run(motion, params);
    const Mat3<double> expected = r.world.coupling(kPose);
    ASSERT_EQ(r.matrices.size(), 22U);  // the first after ten blocks, then one each five blocks
    for (const LowBandMatrix& matrix : r.matrices) {
        EXPECT_LT((matrix.in_phase - expected).norm(), 5e-4 * expected.norm());
        EXPECT_LT(matrix.quadrature.norm(), 5e-4 * expected.norm());
    }
}

TEST(LowBandDemodulator, StatedNoiseIsTheNoiseOfTheCouplings) {
    const sim::StillMotion motion(kPose);
    sim::WorldParams params;
    params.mains_v = 0;
    const Recorded r = run(motion, params);
    const Mat3<double> expected = r.world.coupling(kPose);
    double in_phase = 0;
    double quadrature = 0;
    for (const LowBandMatrix& matrix : r.matrices) {
        in_phase += (matrix.in_phase - expected).cwiseQuotient(matrix.sigma).squaredNorm();
        quadrature += matrix.quadrature.cwiseQuotient(matrix.sigma).squaredNorm();
    }
    const double entries = 9.0 * static_cast<double>(r.matrices.size());
    EXPECT_NEAR(in_phase / entries, 1, 0.35);
    EXPECT_NEAR(quadrature / entries, 1, 0.35);
}

TEST(LowBandDemodulator, AGapStartsANewWindow) {
    const sim::StillMotion motion(kPose);
    const Recorded r = run(motion, {}, 50);
    for (const LowBandMatrix& matrix : r.matrices) {
        const double blocks = 240 * to_seconds(matrix.midpoint);
        EXPECT_TRUE(blocks < 50 - 4.9 || blocks > 51 + 4.9) << blocks;
    }
    EXPECT_EQ(r.matrices.size(), 20U);
}

}  // namespace
}  // namespace tricoil::signal
