// Metal in the samples of the simulated world, by the couplings that the demodulator computes.
#include <gtest/gtest.h>

#include <numbers>

#include "board/support/sim_input/fault_text.hpp"
#include "core/linear/eigen.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/world/coil_world.hpp"
#include "sim/world/metal/sphere.hpp"
#include "sim/world/metal_track.hpp"

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;
using signal::Multiplexing;

const Pose kPose{{0.5, 0.1, 0.05}, Quat<double>(0.8, 0.2, -0.4, 0.1).normalized()};

signal::AcquisitionPlan plan_of(Multiplexing multiplexing) {
    return *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
}

WorldParams quiet() {
    WorldParams params;
    params.converter.noise_v_per_sqrt_hz = 0;
    params.converter.bits = 31;  // the sphere changes the couplings by 1e-6 to 1e-5 of the range of 24 bits
    params.mains_v = 0;
    return params;
}

/// Complex couplings of the last frame of 24 blocks.
ComplexMat3 demodulated(CoilWorld& world, const signal::AcquisitionPlan& plan) {
    world.configure(plan);
    signal::Demodulator<double> demodulator(plan, world.demodulation());
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    ComplexMat3 x = ComplexMat3::Zero();
    for (std::uint32_t n = 0; n < 24; ++n) {
        SampleBlock block;
        block.state = plan.is_tdm() ? single_coil(static_cast<int>(n % 3)) : Excitation::all;
        world.sample(block.state, n * plan.block_s(), samples);
        block.scale = static_cast<float>(world.volts_per_code());
        block.full_scale = world.full_scale();
        block.sequence = n;
        block.samples = samples;
        for (const auto& column : *demodulator.demodulate(block)) {
            eigen(x).col(coil_index(column.state)).real() = eigen(column.in_phase);
            eigen(x).col(coil_index(column.state)).imag() = eigen(column.quadrature);
        }
    }
    return x;
}

/// Couplings (6) plus those that a distant sphere adds, column by column.
ComplexMat3 expected(const Sphere& sphere, const Vec3<double>& place, const Material& material,
                     const signal::AcquisitionPlan& plan) {
    const auto dipole = [](const Vec3<double>& r) -> Mat3<double> {
        return (3 * r * r.transpose() / r.squaredNorm() - Mat3<double>::Identity()) / std::pow(r.norm(), 3);
    };
    const Mat3<double> o = kPose.q_source_sensor.toRotationMatrix().transpose();
    const double half_c = 0.5 * quiet().coupling_constant_m3;
    const Mat3<double> clean = half_c * o * dipole(kPose.position_m);
    const Mat3<double> added = half_c * o * dipole(kPose.position_m - place) * dipole(place);
    ComplexMat3 x = clean.cast<Complex>();
    for (Index j = 0; j < 3; ++j) {
        const double hz = plan.params.carrier_hz[static_cast<std::size_t>(j)];
        x.col(j) += sphere_polarisability(sphere, material, hz) * added.col(j).cast<Complex>();
    }
    return x;
}

TEST(MetalWorld, QuadratureAndFrequencyFollowTheSphere) {
    const StillMotion motion(kPose);
    const Vec3<double> place(0.3, -0.3, 0.1);
    for (const char* name : {"copper", "304", "416"}) {
        const Fault fault =
            host::parse_fault(std::string("metal:sphere,material=") + name + ",radius_m=0.01,position_m=0.3/-0.3/0.1");
        for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm}) {
            const auto plan = plan_of(multiplexing);
            CoilWorld healthy(quiet(), motion, {});
            CoilWorld world(quiet(), motion, {fault});
            const ComplexMat3 clean = demodulated(healthy, plan);
            const ComplexMat3 change = demodulated(world, plan) - clean;
            const ComplexMat3 model = expected(Sphere{0.01}, place, fault.metal->material, plan) -
                                      expected(Sphere{1e-6}, place, fault.metal->material, plan);
            EXPECT_LT(eigen(change - model).norm(), 0.01 * eigen(model).norm()) << name << "\n"
                                                                                << eigen(change) << "\n\n"
                                                                                << eigen(model);
            EXPECT_LT(eigen(clean).imag().norm(), 1e-5 * eigen(clean).norm());
        }
    }
}

/// A sphere that passes the sensor at 1 m/s, its surface 50 mm away; it is nearest at kNearest_s.
constexpr double kNearest_s = 0.15 * std::numbers::pi;
MetalObject passing_sphere() {
    return *host::parse_fault(
                "metal:sphere,material=aluminium,radius_m=0.05,position_m=0.5/-0.2/0.15,to_m=0.5/0.4/0.15,speed_m_s=1")
                .metal;
}

TEST(MetalWorld, AMovingSphereIsFollowed) {
    // The moving sphere gives the couplings of a sphere that rests where the moving one is in the middle of the last window.
    const StillMotion motion(kPose);
    const auto plan = plan_of(Multiplexing::fdm);
    const double middle_s =
        23 * plan.block_s() + (plan.params.guard_samples + 0.5 * (plan.window_samples - 1)) / plan.params.sample_rate_hz;
    Fault moving = host::parse_fault("metal:0.6,0.3,0,0.08");
    moving.metal = passing_sphere();
    moving.metal->pose.position_m.y() += 0.1;  // nearer to the sensor in the last window
    moving.metal->far_m.y() += 0.1;
    Fault still = moving;
    still.metal->pose = moving.metal->at(middle_s);
    still.metal->speed_m_s = 0;
    Fault late = still;
    late.metal->pose = moving.metal->at(middle_s + 0.5 * plan.block_s());
    const auto couplings = [&](const std::vector<Fault>& faults) {
        CoilWorld world(quiet(), motion, faults);
        return demodulated(world, plan);
    };
    const ComplexMat3 clean = couplings({});
    const ComplexMat3 there = couplings({still}) - clean;
    const double error = eigen(couplings({moving}) - clean - there).norm();
    EXPECT_LT(error, 0.2 * eigen(couplings({late}) - clean - there).norm());
}

TEST(MetalWorld, ParabolasFollowAPassingSphere) {
    const StillMotion motion(kPose);
    MetalSet set;
    set.add(passing_sphere(), 0, 1);
    set.tune({1e4});
    constexpr double kSample_s = 1 / 72e3;
    constexpr int kSamples = 288;
    for (const double start_s : {kNearest_s - 0.03, kNearest_s - 0.002, kNearest_s + 0.01}) {
        const MetalTrack track(set, motion, {}, start_s, kSample_s, kSamples);
        double largest = 0;
        double error = 0;
        for (int n = -1; n < kSamples; n += 7) {
            const ComplexMat3 field = set.field(kPose.position_m, start_s + n * kSample_s, start_s)[0];
            largest = std::max(largest, eigen(field).norm());
            error = std::max(error, (track.at(n) - eigen(field)).norm());
        }
        EXPECT_LT(error, 3e-4 * largest) << start_s;
    }
}

}  // namespace
}  // namespace tricoil::sim
