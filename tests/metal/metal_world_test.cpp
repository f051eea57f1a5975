// Metal in the samples: what the demodulator reads from the simulated world.
#include <gtest/gtest.h>

#include "board/support/sim_input/fault_text.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/world/coil_world.hpp"
#include "sim/world/metal/sphere.hpp"

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

/// Complex couplings of the last frame of a second's tenth.
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
            x.col(coil_index(column.state)).real() = column.in_phase;
            x.col(coil_index(column.state)).imag() = column.quadrature;
        }
    }
    return x;
}

/// (6) and its addition by a far sphere, column by column.
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
    for (Eigen::Index j = 0; j < 3; ++j) {
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
            EXPECT_LT((change - model).norm(), 0.01 * model.norm()) << name << "\n" << change << "\n\n" << model;
            EXPECT_LT(clean.imag().norm(), 1e-5 * clean.norm());
        }
    }
}

TEST(MetalWorld, AMovingSphereIsFollowed) {
    // After 0.1 s at 1 m/s the sphere is where a sphere at rest gives the same couplings.
    const StillMotion motion(kPose);
    const auto plan = plan_of(Multiplexing::fdm);
    const Fault moving =
        host::parse_fault("metal:sphere,material=aluminium,radius_m=0.05,position_m=0.3/-0.3/0.1,to_m=0.3/0.3/0.1,speed_m_s=1");
    const double middle_s =
        23 * plan.block_s() + (plan.params.guard_samples + 0.5 * (plan.window_samples - 1)) / plan.params.sample_rate_hz;
    Fault still = moving;
    still.metal->pose = moving.metal->at(middle_s);
    still.metal->speed_m_s = 0;
    CoilWorld healthy(quiet(), motion, {});
    CoilWorld moved(quiet(), motion, {moving});
    CoilWorld rested(quiet(), motion, {still});
    const ComplexMat3 clean = demodulated(healthy, plan);
    const ComplexMat3 there = demodulated(rested, plan) - clean;
    EXPECT_LT((demodulated(moved, plan) - clean - there).norm(), 0.02 * there.norm());
}

TEST(MetalWorld, TurningTheObjectTurnsTheField) {
    MetalSet set;
    MetalObject object;
    object.shape = Sphere{0.05};
    object.pose = {{0.3, 0.1, 0}, Quat<double>::Identity()};
    set.add(object, 0, 1);
    object.pose.q_source_sensor = Quat<double>(0.5, 0.5, 0.5, 0.5);
    MetalSet turned;
    turned.add(object, 0, 1);
    set.tune({1e4});
    turned.tune({1e4});
    const ComplexMat3 field = set.field({0.6, 0, 0.1}, 0.5, 0.5)[0];
    EXPECT_LT((turned.field({0.6, 0, 0.1}, 0.5, 0.5)[0] - field).norm(), 1e-12 * field.norm());
    EXPECT_TRUE(set.field({0.6, 0, 0.1}, 1.5, 1.5)[0].isZero(0));
    EXPECT_FALSE(set.acts_at(1.5));
}

}  // namespace
}  // namespace tricoil::sim
