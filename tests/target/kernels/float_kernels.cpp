#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/field/concentric_dipole.hpp"
#include "core/signal/demodulator.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/previous_measurement.hpp"
#include "core/tracking/matrix/direct_tracker.hpp"
#include "core/tracking/matrix/previous_tracker.hpp"
#include "tests/target/kernels/kernel.hpp"

namespace tricoil::target {
namespace {

constexpr int kPoses = 12;
constexpr int kBlock = 200;
constexpr int kCycles = 10;
constexpr float kNearby_rad = 0.03F;  // between the pose and the start pose of the step

/// Poses around the source, in seven octants and on the z axis, 0.2 to 0.9 m away.
solver::VectorPose<float> pose_of(int run) {
    const auto n = static_cast<float>(run);
    solver::VectorPose<float> pose;
    pose.range_m = 0.2F + 0.06F * n;
    pose.direction = run == 0 ? Vec3<float>(0, 0, 1) : geometry::direction(0.9F * n, 0.31F * n - 1.5F);
    pose.attitude = geometry::attitude_matrix(geometry::Euler<float>{1.1F * n, 0.3F * n - 1.4F, 2.3F * n});
    return pose;
}

struct Inputs {
    Mat3<float> x;
    solver::VectorPose<float> previous;
    solver::AnglePose<float> previous_angles;
    std::array<Sample, kBlock> samples;
};

struct Outputs {
    solver::DirectSolution<float> direct;
    solver::VectorPose<float> vectors;
    solver::AnglePose<float> angles;
    signal::ChannelPhasors<float> phasors;
    bool ok;
};

// Global variables, so that the compiler can neither precompute a kernel nor remove it.
Inputs inputs;
Outputs outputs;

void prepare_pose(int run) {
    const auto pose = pose_of(run);
    inputs.x = field::signal_matrix<float>(1, pose.range_m * pose.direction, pose.attitude);
    const auto turn = geometry::rotation_z(kNearby_rad);
    inputs.previous = {pose.range_m * 1.01F, turn * pose.direction, pose.attitude * turn};
    inputs.previous_angles = {geometry::to_spherical<float>(inputs.previous.range_m * inputs.previous.direction),
                              geometry::to_euler(inputs.previous.attitude)};
}

void run_direct(int) {
    const auto solution = solver::solve_direct(inputs.x, 1.0F);
    outputs.ok = solution.ok();
    outputs.direct = *solution;
}

void run_previous(int) {
    const auto next = solver::step_vectors(inputs.x, 1.0F, inputs.previous);
    outputs.ok = next.ok();
    outputs.vectors = *next;
}

void run_previous_angles(int) {
    const auto next = solver::step_angles(inputs.x, 1.0F, inputs.previous_angles);
    outputs.ok = next.ok();
    outputs.angles = *next;
}

signal::Oscillator<float> oscillator;

void prepare_samples(int) {
    oscillator = signal::Oscillator<float>(kCycles, kBlock);
    for (std::size_t n = 0; n < kBlock; ++n) {
        const float angle = 2 * std::numbers::pi_v<float> * kCycles * static_cast<float>(n) / kBlock;
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            const float amplitude = 4e6F / static_cast<float>(channel + 1);
            inputs.samples[n][channel] = static_cast<std::int32_t>(amplitude * std::cos(angle + static_cast<float>(channel)));
        }
    }
}

void run_lock_in(int) { outputs.phasors = signal::lock_in(oscillator, std::span<const Sample>(inputs.samples)); }

std::optional<signal::Demodulator<float>> demodulator;
SampleBlock block;

/// The complete processing of a block, with health and noise: 240 Hz TDM at 144 kS/s, 200 samples of which 160 are used.
void prepare_block(int run) {
    prepare_samples(run);
    const auto plan = signal::plan_acquisition(signal::default_acquisition(signal::Multiplexing::tdm, 240));
    const signal::DemodulatorParams<float> params;
    demodulator.emplace(*plan, params);
    block.state = Excitation::s1;
    block.scale = 3e-7F;
    block.full_scale = 8'388'607;
    block.samples = inputs.samples;
}

void run_demodulator(int) { outputs.ok = demodulator->demodulate(block).ok(); }

std::optional<tracking::DirectTracker<float>> direct_tracker;
std::optional<tracking::PreviousTracker<float>> previous_tracker;
tracking::Tracker<float>* tracker = nullptr;
std::array<Column<float>, 3> columns;

/// A tracker that has processed five columns; the next column completes the second matrix.
void prepare_tracker(int run) {
    prepare_pose(run);
    tracking::TrackerParams<float> params;
    params.common.max_column_span = Microseconds{3500};
    if (run % 2 == 0) {
        tracker = &direct_tracker.emplace(params);
    } else {
        params.method = tracking::PreviousParams{};
        tracker = &previous_tracker.emplace(params);
    }
    for (int n = 0; n < 6; ++n) {
        Column<float>& column = columns[static_cast<std::size_t>(n % 3)];
        column.state = single_coil(n % 3);
        column.in_phase = inputs.x.col(n % 3);
        column.sigma.setConstant(1e-4F);
        column.midpoint = device_time_us(1389 * n);
        if (n < 5) {
            (void)tracker->update(column);
        }
    }
}

void run_tracker(int) { outputs.ok = tracker->update(columns[2]).has_value(); }

constexpr std::array<Kernel, 6> kKernels{{
    {"direct", kPoses, prepare_pose, run_direct},
    {"previous", kPoses, prepare_pose, run_previous},
    {"previous-angles", kPoses, prepare_pose, run_previous_angles},
    {"lock-in", 1, prepare_samples, run_lock_in},
    {"demodulator", 1, prepare_block, run_demodulator},
    {"tracker", kPoses, prepare_tracker, run_tracker},
}};

}  // namespace

std::span<const Kernel> float_kernels() { return kKernels; }

}  // namespace tricoil::target
