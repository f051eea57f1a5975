#include "sim/world/coil_world.hpp"
#include "board/support/sim_input/fault_text.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "core/field/concentric_dipole.hpp"
#include "core/linear/eigen.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/world/metal/sphere.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::sim {
namespace {

using signal::Multiplexing;

signal::AcquisitionPlan plan_of(Multiplexing multiplexing) {
    return *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
}

WorldParams quiet() {
    WorldParams params;
    params.converter.noise_v_per_sqrt_hz = 0;
    params.mains_v = 0;
    return params;
}

/// Signal matrix that the demodulator computes from six blocks of the world: the newest column of each coil, in the low band if
/// there is one.
Mat3<double> measured(CoilWorld& world, const signal::AcquisitionPlan& plan, double start_s) {
    signal::Demodulator<double> demodulator(plan, world.demodulation());
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    Mat3<double> x = Mat3<double>::Zero();
    for (std::uint32_t n = 0; n < 6; ++n) {
        SampleBlock block;
        block.state = plan.is_tdm() ? single_coil(static_cast<int>(n % 3)) : Excitation::all;
        world.sample(block.state, start_s + n * plan.block_s(), samples);
        block.scale = static_cast<float>(world.volts_per_code());
        block.full_scale = world.full_scale();
        block.sequence = n;
        block.samples = samples;
        for (const auto& column : *demodulator.demodulate(block)) {
            x.col(coil_index(column.state)) = column.in_phase;
        }
    }
    return x;
}

Mat3<double> demodulated(CoilWorld& world, const signal::AcquisitionPlan& plan) {
    world.configure(plan);
    return measured(world, plan, 0);
}

TEST(CoilWorld, DemodulatedCouplingsEqualTheFieldModel) {
    const Pose pose{{0.3, -0.2, 0.25}, Quat<double>(0.8, 0.2, -0.4, 0.1).normalized()};
    const StillMotion motion(pose);
    const auto model = field::signal_matrix<double>(quiet().coupling_constant_m3, pose.position_m,
                                                    geometry::attitude_matrix(pose.q_source_sensor));
    for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm}) {
        CoilWorld world(quiet(), motion, {});
        EXPECT_LT((demodulated(world, plan_of(multiplexing)) - model).norm(), 1e-5 * model.norm());
    }
}

TEST(CoilWorld, MotionLeaksIntoTheQuadratureAlsoAfterAStartAtAnyTime) {
    const LineMotion motion({{0.6, 0.1, 0.2}, Quat<double>::Identity()}, {0.05, 0.05, 0.05}, 2);
    for (const auto multiplexing : {Multiplexing::fdm, Multiplexing::dual_band}) {
        const auto plan = plan_of(multiplexing);
        CoilWorld world(quiet(), motion, {});
        world.configure(plan);
        for (const double start_s : {0.0013, 0.1018, 0.2}) {  // with pauses
            const Mat3<double> x = measured(world, plan, start_s);
            const Mat3<double> model = world.coupling(motion.at(start_s + 5.5 * plan.block_s()));
            EXPECT_LT((x - model).norm(), 2e-4 * model.norm()) << plan.carriers() << " carriers from " << start_s << " s";
        }
    }
}

TEST(CoilWorld, MismatchMatricesActOnSourceAndSensor) {
    const Pose pose{{0.3, -0.2, 0.25}, Quat<double>(0.8, 0.2, -0.4, 0.1).normalized()};
    const StillMotion motion(pose);
    auto params = quiet();
    params.source_matrix(0, 1) = 0.05;
    params.sensor_matrix(2, 2) = 0.97;
    CoilWorld world(params, motion, {});
    const auto ideal = field::signal_matrix<double>(params.coupling_constant_m3, pose.position_m,
                                                    geometry::attitude_matrix(pose.q_source_sensor));
    const Mat3<double> expected = params.sensor_matrix * ideal * params.source_matrix;
    EXPECT_LT((demodulated(world, plan_of(Multiplexing::fdm)) - expected).norm(), 1e-5 * expected.norm());
}

TEST(CoilWorld, FaultsShowInTheCouplings) {
    const Pose pose{{0.4, 0.1, 0.2}, Quat<double>::Identity()};
    const StillMotion motion(pose);
    const auto with = [&](const std::string& fault) {
        CoilWorld world(quiet(), motion, {host::parse_fault(fault)});
        return demodulated(world, plan_of(Multiplexing::tdm));
    };
    CoilWorld healthy(quiet(), motion, {});
    const Mat3<double> x = demodulated(healthy, plan_of(Multiplexing::tdm));
    EXPECT_TRUE(is_approx(with("reversed_coil:S1").col(0), -x.col(0), 1e-4));
    EXPECT_TRUE(is_approx(with("reversed_coil:C2").row(1), -x.row(1), 1e-4));
    EXPECT_TRUE(is_approx(with("swapped_coils:S1,S2").col(0), x.col(1), 1e-4));
    EXPECT_TRUE(is_approx(with("swapped_coils:C2,C3").row(2), x.row(1), 1e-4));
    EXPECT_TRUE(with("open_coil:S3").col(2).isZero(1e-9));
    EXPECT_TRUE(with("stuck_channel:C1").row(0).isZero(1e-9));
    const Vec3<double> unplugged = eigen(with("unplugged")).jacobiSvd().singularValues();
    EXPECT_LT(unplugged(1), 0.01 * unplugged(0));
    const double misfit = (with("metal:0.4,0.3,0.2,0.1") - x).norm() / x.norm();
    EXPECT_GT(misfit, 1e-3);
    EXPECT_LT(misfit, 0.3);
}

TEST(CoilWorld, ANearbySphereOpposesTheField) {
    // A conducting sphere on the axis between source and sensor reduces the axial coupling. On the axis, order n of the response
    // is (-1)^n (n + 1)^2 A_n a^(2n+1) / (d s)^(n+2).
    const StillMotion motion({{0.6, 0, 0}, Quat<double>::Identity()});
    CoilWorld world(quiet(), motion, {host::parse_fault("metal:0.3,0,0,0.05")});
    const auto plan = plan_of(Multiplexing::fdm);
    const auto z = propagation_constant({3.77e7, 1, 1}, plan.params.carrier_hz[0]) * 0.05;
    double added = 0;
    for (int n = 1; n < 20; ++n) {
        const double sign = n % 2 == 0 ? 1 : -1;
        added +=
            sign * (n + 1) * (n + 1) * sphere_coefficient(n, z, 1).real() * std::pow(0.05, 2 * n + 1) / std::pow(0.09, n + 2);
    }
    const double expected = 6.75e-3 * (1 / 0.216 + added / 2);
    EXPECT_LT(added, 0);
    EXPECT_NEAR(demodulated(world, plan)(0, 0), expected, 1e-4 * expected);
}

TEST(CoilWorld, SigmaEqualsTheScatterOfTheCouplings) {
    WorldParams params;
    params.mains_v = 0;
    const StillMotion motion({{0.5, 0.1, 0.2}, Quat<double>::Identity()});
    for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm}) {
        double squares = 0;
        double sigma = 0;
        for (std::uint64_t seed = 1; seed <= 60; ++seed) {
            params.seed = seed;
            CoilWorld world(params, motion, {});
            const Mat3<double> x = demodulated(world, plan_of(multiplexing));
            squares += (x - world.coupling(motion.at(0))).squaredNorm() / (9 * 60);
            sigma = world.coupling_sigma();
        }
        EXPECT_NEAR(std::sqrt(squares) / sigma, 1, 0.12);  // standard error 0.03
    }
}

TEST(CoilWorld, TheGuardExcludesCurrentTransients) {
    // With the guard the coupling is exact; without it the window contains transients of this coil and of the previous one.
    const StillMotion motion({{0.4, 0.1, 0.2}, Quat<double>::Identity()});
    CoilWorld world(quiet(), motion, {});
    const auto guarded = plan_of(Multiplexing::tdm);
    auto params = guarded.params;
    params.guard_samples = 0;
    const auto unguarded = *signal::plan_acquisition(params);
    const Mat3<double> x = world.coupling(motion.at(0));
    EXPECT_LT((demodulated(world, guarded) - x).norm(), 1e-5 * x.norm());
    EXPECT_GT((demodulated(world, unguarded) - x).norm(), 1e-3 * x.norm());
}

TEST(CoilWorld, RefusesInvalidParameters) {
    const StillMotion motion({});
    const auto refused = [&](auto spoil) {
        WorldParams params;
        spoil(params);
        try {
            CoilWorld world(params, motion, {});
        } catch (const std::exception&) {
            return true;
        }
        return false;
    };
    EXPECT_FALSE(refused([](auto&) {}));
    EXPECT_TRUE(refused([](auto& p) { p.coupling_constant_m3 = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.coil_inductance_h = -1; }));
    EXPECT_TRUE(refused([](auto& p) { p.converter.bits = 40; }));
    EXPECT_TRUE(refused([](auto& p) { p.source_matrix.setZero(); }));
    EXPECT_TRUE(refused([](auto& p) { p.mains_v = std::numeric_limits<double>::quiet_NaN(); }));
}

TEST(SimulatedHal, IsDeterministicFromItsSeed) {
    const HandMotion motion({0.6, 0, 0}, 3);
    const auto plan = plan_of(Multiplexing::tdm);
    const auto first_samples = [&](std::uint64_t seed) {
        WorldParams params;
        params.seed = seed;
        CoilWorld world(params, motion, {});
        SimulatedClock clock;
        SimulatedCoilDriver coils;
        SimulatedCoilSampler sampler(world, coils, clock, 1);
        EXPECT_TRUE(sampler.start(plan).ok());
        EXPECT_TRUE(coils.excite(Excitation::s1).ok());
        SampleBlock block;
        EXPECT_TRUE(sampler.poll(block).ok());
        return std::vector<Sample>(block.samples.begin(), block.samples.end());
    };
    EXPECT_EQ(first_samples(1), first_samples(1));
    EXPECT_NE(first_samples(1), first_samples(2));
}

TEST(SimulatedHal, SamplerRefusesBeforeStartAndTimesOut) {
    const StillMotion motion({{0.5, 0, 0}, Quat<double>::Identity()});
    CoilWorld world(quiet(), motion, {host::parse_fault("dropped_blocks:1@0.1-0.2")});
    SimulatedClock clock(device_time_us((std::int64_t{1} << 32) - 50'000));
    SimulatedCoilDriver coils;
    SimulatedCoilSampler sampler(world, coils, clock, 0.3);
    SampleBlock block;
    EXPECT_EQ(sampler.poll(block).code(), StatusCode::not_ready);
    const auto plan = plan_of(Multiplexing::fdm);
    ASSERT_TRUE(sampler.start(plan).ok());
    int received = 0;
    int lost = 0;
    Status status;
    DeviceTime last{};
    while ((status = sampler.poll(block)).code() != StatusCode::end_of_stream) {
        status.ok() ? ++received : ++lost;
        EXPECT_TRUE(!status.ok() || block.start > last);
        last = block.start;
    }
    EXPECT_EQ(received + lost, 72);
    EXPECT_EQ(lost, 24);
    EXPECT_EQ(block.sequence, 71U);
    sampler.stop();
    EXPECT_EQ(sampler.poll(block).code(), StatusCode::not_ready);
}

}  // namespace
}  // namespace tricoil::sim
