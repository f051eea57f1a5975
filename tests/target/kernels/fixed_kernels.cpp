#include <array>

#include "core/field/concentric_dipole.hpp"
#include "core/fixed/tracker.hpp"
#include "core/geometry/angles.hpp"
#include "tests/support/integer_blocks.hpp"
#include "tests/target/kernels/kernel.hpp"

namespace tricoil::target {
namespace {

constexpr int kPoses = 12;
constexpr float kNearby_rad = 0.03F;
constexpr int kCodeExponent = -13;  // of the unit of the couplings
constexpr fixed::Scaled kOne{1 << 30, -30};

struct Inputs {
    fixed::BlockMatrix x;
    fixed::VectorPose previous;
    fixed::Angle angle;
};

struct Outputs {
    fixed::DirectSolution direct;
    fixed::VectorPose vectors;
    fixed::SineCosine sine_cosine;
    bool ok;
};

Inputs inputs;
Outputs outputs;

fixed::Unit unit(float value) { return fixed::Unit::from_raw(static_cast<std::int32_t>(value * 1073741824.0F)); }

/// Same poses as in the floating-point kernels.
void prepare(int run) {
    const auto n = static_cast<float>(run);
    const float range = 0.2F + 0.06F * n;
    const Vec3<float> direction = run == 0 ? Vec3<float>(0, 0, 1) : geometry::direction(0.9F * n, 0.31F * n - 1.5F);
    const Mat3<float> attitude = geometry::attitude_matrix(geometry::Euler<float>{1.1F * n, 0.3F * n - 1.4F, 2.3F * n});
    const Mat3<float> x = field::signal_matrix<float>(1, range * direction, attitude);
    const Mat3<float> turn = geometry::rotation_z(kNearby_rad);
    const Vec3<float> before = turn * direction;
    const Mat3<float> attitude_before = attitude * turn;
    inputs.x.exponent = kCodeExponent;
    inputs.previous.range_m = fixed::Metres::from_raw(static_cast<std::int32_t>(range * 268435456.0F));
    for (Index i = 0; i < 9; ++i) {
        inputs.x.mantissa(i) = static_cast<std::int32_t>(x(i) * 8192.0F);
        inputs.previous.attitude(i) = unit(attitude_before(i));
    }
    for (Index i = 0; i < 3; ++i) {
        inputs.previous.direction(i) = unit(before(i));
    }
    inputs.angle.turns = 357'913'941U * static_cast<std::uint32_t>(run);
}

void run_direct(int) {
    const auto solution = fixed::solve_direct(inputs.x, kOne);
    outputs.ok = solution.ok();
    outputs.direct = *solution;
}

void run_previous(int) {
    const auto next = fixed::step_vectors(inputs.x, kOne, inputs.previous);
    outputs.ok = next.ok();
    outputs.vectors = *next;
}

void run_sine_cosine(int) { outputs.sine_cosine = fixed::sine_cosine(inputs.angle); }

constexpr int kBlock = 200;
constexpr int kCycles = 10;
const fixed::Oscillator oscillator(kCycles, kBlock);
std::array<Sample, kBlock> samples;
std::array<fixed::Phasor, kChannels> phasors;
fixed::BlockColumn column;

void prepare_samples(int) {
    for (std::size_t n = 0; n < kBlock; ++n) {
        const auto turns = static_cast<std::uint32_t>((std::uint64_t{n} * kCycles << 32) / kBlock);
        const std::int32_t carrier = fixed::sine_cosine({turns}).cosine.raw() >> 8;
        samples[n] = {carrier / 2, -carrier / 3, carrier / 5, carrier};
    }
}

void run_lock_in(int) { phasors = fixed::lock_in(oscillator, std::span<const Sample>(samples)); }

void prepare_phasors(int run) {
    prepare_samples(run);
    run_lock_in(run);
}

void run_couplings(int) {
    const auto couplings = fixed::couplings(phasors, kBlock, 1000);
    outputs.ok = couplings.ok();
    column = *couplings;
}

// Processing of a complete block: 200 samples of 4 channels give a pose with flags. The third block acquires, the others track.
test::IntegerBlocks integer_blocks;
fixed::Tracker tracker(test::IntegerBlocks::kAcquisition, {}, {});
SampleBlock block;

void prepare_block(int run) {
    Mat3<std::int32_t> x;
    x << 400'000, 30'000, -20'000, 25'000, -210'000, 15'000, -15'000, 10'000, -190'000;
    x(0, 1) += 2'000 * run;
    block = integer_blocks.next(x);
}

void run_tracker(int) { outputs.ok = tracker.update(block).has_value(); }

constexpr std::array<Kernel, 6> kKernels{{
    {"fixed-direct", kPoses, prepare, run_direct},
    {"fixed-previous", kPoses, prepare, run_previous},
    {"fixed-lock-in", 1, prepare_samples, run_lock_in},
    {"fixed-couplings", 1, prepare_phasors, run_couplings},
    {"fixed-sine-cosine", kPoses, prepare, run_sine_cosine},
    {"fixed-tracker", 9, prepare_block, run_tracker},
}};

}  // namespace

std::span<const Kernel> fixed_kernels() { return kKernels; }

}  // namespace tricoil::target
