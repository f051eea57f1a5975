// The integer tracker against the one in double, on the same simulated samples; then faults.
#include "core/fixed/tracker.hpp"
#include "board/support/sim_input/fault_text.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/linear/eigen.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/fixed/converter.hpp"
#include "tests/support/paths.hpp"

namespace tricoil::fixed {
namespace {

using tracking::PoseFlag;
using tracking::PoseFlags;
using tracking::TrackerState;

/// Simulated world whose samples go to both trackers.
class Pair {
public:
    Pair(signal::Multiplexing multiplexing, const sim::Motion& motion, const sim::WorldParams& world_params,
         std::vector<sim::Fault> faults = {}, bool confined = false, Method method = Method::previous,
         double max_deviation_m = 10)
        : plan_(*signal::plan_acquisition(signal::default_acquisition(multiplexing, 240))),
          world_(world_params, motion, std::move(faults)),
          sampler_(world_, coils_, clock_, 1e9) {
        world_.configure(plan_);
        const signal::DemodulatorParams<double> demodulator = world_.demodulation();
        demodulator_.emplace(plan_, demodulator);
        tracking::TrackerParams<double> params;
        if (method == Method::direct) {
            params.method = tracking::DirectParams{};
        } else {
            params.method = tracking::PreviousParams{};
        }
        params.common.max_deviation_m = max_deviation_m;  // the integer tracker has no such limit
        params.common.coupling_constant = world_params.coupling_constant_m3;
        params.common.max_column_span = tracking::column_span(plan_);
        params.common.confined = confined;
        exact_.emplace(params);
        TrackerParams fixed_params;
        fixed_params.method = method;
        fixed_params.coupling_constant = scaled_from(world_params.coupling_constant_m3);
        fixed_params.confined = confined;
        ours_.emplace(*acquisition_of(plan_), *demodulator_params_from(demodulator, world_.volts_per_code()), fixed_params);
        EXPECT_TRUE(static_cast<hal::CoilSampler&>(sampler_).start(plan_).ok());
    }

    struct Poses {
        std::optional<tracking::PoseEstimate<double>> exact;
        std::optional<PoseEstimate> ours;
        bool arrived = false;
    };

    /// Processes one block with both trackers.
    Poses step() {
        const Excitation state = plan_.is_tdm() ? single_coil(static_cast<int>(blocks_++ % 3)) : Excitation::all;
        EXPECT_TRUE(static_cast<hal::CoilDriver&>(coils_).excite(state).ok());
        SampleBlock block;
        Poses poses;
        poses.arrived = static_cast<hal::CoilSampler&>(sampler_).poll(block).ok();
        if (!poses.arrived) {
            const DeviceTime now = static_cast<hal::Clock&>(clock_).now();
            poses.exact = exact_->tick(now);
            poses.ours = ours_->tick(now);
            return poses;
        }
        const auto columns = demodulator_->demodulate(block);
        for (const auto& column : *columns) {
            if (const auto estimate = exact_->update(column)) {
                poses.exact = estimate;
            }
        }
        poses.ours = ours_->update(block);
        return poses;
    }

    [[nodiscard]] Tracker& ours() { return *ours_; }
    [[nodiscard]] double elapsed_s() const { return clock_.elapsed_s(); }

private:
    signal::AcquisitionPlan plan_;
    sim::CoilWorld world_;
    sim::SimulatedCoilDriver coils_;
    sim::SimulatedClock clock_;
    sim::SimulatedCoilSampler sampler_;
    std::optional<signal::Demodulator<double>> demodulator_;
    std::optional<tracking::AnyTracker> exact_;
    std::optional<Tracker> ours_;
    unsigned blocks_ = 0;
};

struct Worst {
    double position_m = 0;
    double attitude_rad = 0;
    double position_squares = 0;  // summed over all poses
    double attitude_squares = 0;
    double noise_share = 0;  // relative
    int valid = 0;
    int different_flags = 0;
};

Quat<double> to_double(const Quaternion& q) { return {q.w.to_double(), q.x.to_double(), q.y.to_double(), q.z.to_double()}; }

/// Flags that both trackers must share. Only the tracker in double distinguishes motion from distortion.
PoseFlags shared(PoseFlags flags) { return flags | PoseFlags{PoseFlag::distorted}; }

Worst compare(signal::Multiplexing multiplexing, int bits, double seconds, Method method = Method::previous) {
    const sim::HandMotion motion({0.45, 0.1, -0.15}, 3);
    sim::WorldParams world;
    world.converter.bits = bits;
    Pair pair(multiplexing, motion, world, {}, false, method);
    Worst worst;
    while (pair.elapsed_s() < seconds) {
        const auto [exact, ours, arrived] = pair.step();
        EXPECT_EQ(exact.has_value(), ours.has_value());
        if (!exact || !ours) {
            continue;
        }
        worst.different_flags += shared(exact->flags) == shared(ours->flags) && exact->time == ours->time ? 0 : 1;
        worst.valid += ours->valid() ? 1 : 0;
        const double position_m = (to_double(ours->position_m) - exact->position_m).norm();
        const double attitude_rad = geometry::angle_between(to_double(ours->q_source_sensor), exact->q_source_sensor);
        worst.position_m = std::max(worst.position_m, position_m);
        worst.attitude_rad = std::max(worst.attitude_rad, attitude_rad);
        worst.position_squares += position_m * position_m;
        worst.attitude_squares += attitude_rad * attitude_rad;
        const auto shown = to_double(*ours);
        // The trackers estimate the noise independently; SNR and covariance depend on it. The integer tracker's covariance
        // contains noise alone, not motion or misfit.
        const double noise_ratio = ours->noise_share.to_double() * std::pow(10, exact->snr_db / 20);
        EXPECT_NEAR(shown.snr_db, exact->snr_db - 20 * std::log10(noise_ratio), 0.01);
        const double range_m = exact->position_m.norm();
        const double sigma_share = std::pow(10, -exact->snr_db / 20);
        const auto noise = solver::pose_covariance<double>(1, range_m, exact->position_m / range_m, sigma_share);
        EXPECT_NEAR(std::sqrt(shown.covariance.trace() / noise.trace()), noise_ratio, 2e-3);
        worst.noise_share = std::max(worst.noise_share, std::abs(noise_ratio - 1));
    }
    const double n = worst.valid;
    std::printf(
        "%s, %s, %d bits: from double RMS %.2g mm, %.2g deg, worst %.2g mm, %.2g deg, noise share %.2g; %d poses, %d with "
        "other flags\n",
        method == Method::direct ? "direct" : "previous", multiplexing == signal::Multiplexing::tdm ? "TDM" : "FDM", bits,
        1e3 * std::sqrt(worst.position_squares / n), 57.29578 * std::sqrt(worst.attitude_squares / n), worst.position_m * 1e3,
        worst.attitude_rad * 57.29578, worst.noise_share, worst.valid, worst.different_flags);
    return worst;
}

TEST(FixedTracker, StaysWithDoubleOnTimeDivision) {
    const Worst worst = compare(signal::Multiplexing::tdm, 24, 6);
    EXPECT_GT(worst.valid, 4000);
    EXPECT_LT(worst.position_m, 1e-6);
    EXPECT_LT(worst.attitude_rad, 4e-6);
    EXPECT_LT(worst.noise_share, 0.02);
    EXPECT_LE(worst.different_flags, worst.valid / 100);
}

/// Two turns about z: the sign of the quaternion of an attitude matrix changes on the way.
TEST(FixedTracker, QuaternionSignsAreContinuous) {
    const sim::CircleMotion motion({0.5, 0, 0}, 0.1, 1);
    Pair pair(signal::Multiplexing::fdm, motion, {}, {}, true, Method::direct);
    Quat<double> last = Quat<double>::Identity();
    double least = 1;
    double least_w = 1;
    while (pair.elapsed_s() < 2) {
        if (const auto ours = pair.step().ours) {
            const Quat<double> q = to_double(ours->q_source_sensor);
            least = std::min(least, q.dot(last));
            least_w = std::min(least_w, q.w());
            last = q;
        }
    }
    EXPECT_GT(least, 0.9);
    EXPECT_LT(least_w, -0.9);
}

TEST(FixedTracker, StaysWithDoubleByTheDirectSolution) {
    const Worst worst = compare(signal::Multiplexing::tdm, 24, 4, Method::direct);
    EXPECT_GT(worst.valid, 2500);
    EXPECT_LT(worst.position_m, 1e-6);
    EXPECT_LT(worst.attitude_rad, 4e-6);
    EXPECT_LE(worst.different_flags, worst.valid / 100);
}

TEST(FixedTracker, StaysWithDoubleOnSixteenBits) {
    const Worst worst = compare(signal::Multiplexing::tdm, 16, 3);
    EXPECT_GT(worst.valid, 2000);
    EXPECT_LT(worst.position_m, 4e-6);  // a code is 76 microvolts
    EXPECT_LT(worst.attitude_rad, 4e-6);
}

TEST(FixedTracker, StaysWithDoubleOnFrequencyDivision) {
    const Worst worst = compare(signal::Multiplexing::fdm, 24, 4);
    EXPECT_GT(worst.valid, 900);
    EXPECT_LT(worst.position_m, 1e-6);
    EXPECT_LT(worst.attitude_rad, 4e-6);
    EXPECT_LE(worst.different_flags, worst.valid / 100);
}

struct FaultRun {
    double first_invalid_s = 1e9;  // after the fault's begin
    double valid_again_s = 1e9;    // after its end
    int answered_alone = 0;        // instants at which only one of the trackers gave a pose
    int valid_within = 0;          // valid poses 20 ms into the fault and later
    PoseFlags flags;               // seen within the fault
    double worst_valid_m = 0;      // distance from the truth of valid poses outside the fault
    TrackerState state_at_end{};
    TrackerCounters counters;
};

FaultRun play(const std::string& fault, double begin_s = 0.5, double end_s = 1) {
    const sim::Pose pose{{0.3, 0.15, -0.1}, Quat<double>(0.9, 0.2, -0.3, 0.1).normalized()};
    const sim::StillMotion motion(pose);
    Pair pair(signal::Multiplexing::tdm, motion, {},
              {host::parse_fault(fault + "@" + std::to_string(begin_s) + "-" + std::to_string(end_s))}, true, Method::previous,
              0.02);
    FaultRun run;
    while (pair.elapsed_s() < end_s + 0.3) {
        const double t = pair.elapsed_s();
        const auto [exact, ours, arrived] = pair.step();
        run.answered_alone += exact.has_value() != ours.has_value() ? 1 : 0;
        if (!ours || !exact) {
            continue;
        }
        if (t >= begin_s && t < end_s) {
            run.flags |= ours->flags;
            run.first_invalid_s = ours->valid() ? run.first_invalid_s : std::min(run.first_invalid_s, t - begin_s);
            run.valid_within += ours->valid() && t > begin_s + 0.02 ? 1 : 0;
            if (!exact->flags.has(PoseFlag::uncertain)) {  // only the tracker in double sets this flag
                EXPECT_EQ(ours->valid(), exact->valid()) << fault << " at " << t;
            }
            run.state_at_end = ours->state;
        } else if (ours->valid()) {
            run.worst_valid_m = std::max(run.worst_valid_m, (to_double(ours->position_m) - pose.position_m).norm());
            run.valid_again_s = t >= end_s ? std::min(run.valid_again_s, t - end_s) : run.valid_again_s;
        }
    }
    // After a gap the double tracker waits for a second column before it accepts the time of the first one; the integer tracker
    // does not.
    EXPECT_LE(run.answered_alone, 1) << fault;
    run.counters = pair.ours().counters();
    EXPECT_EQ(pair.ours().state(), TrackerState::tracking) << fault;
    EXPECT_LT(run.worst_valid_m, 1e-4) << fault;
    EXPECT_LT(run.valid_again_s, 0.02) << fault;
    return run;
}

TEST(FixedTrackerFault, Unplugged) {
    const FaultRun run = play("unplugged");
    EXPECT_LT(run.first_invalid_s, 0.01);
    EXPECT_TRUE(run.flags.has(PoseFlag::no_sensor));
    EXPECT_EQ(run.valid_within, 0);
    EXPECT_EQ(run.state_at_end, TrackerState::lost);
    EXPECT_EQ(run.counters.acquisitions, 2U);
}

TEST(FixedTrackerFault, Overload) {
    const FaultRun run = play("overload:40");
    EXPECT_LT(run.first_invalid_s, 0.01);
    EXPECT_TRUE(run.flags.has(PoseFlag::saturated));
    EXPECT_EQ(run.valid_within, 0);
}

TEST(FixedTrackerFault, StuckChannel) {
    const FaultRun run = play("stuck_channel:C2");
    EXPECT_LT(run.first_invalid_s, 0.01);
    EXPECT_TRUE(run.flags.has(PoseFlag::no_sensor));
    EXPECT_EQ(run.valid_within, 0);
}

TEST(FixedTrackerFault, NoReference) {
    const FaultRun run = play("stuck_channel:R");
    EXPECT_TRUE(run.flags.has(PoseFlag::no_reference));
    EXPECT_EQ(run.valid_within, 0);
}

TEST(FixedTrackerFault, ReversedCoil) {
    const FaultRun run = play("reversed_coil:C1");
    EXPECT_TRUE(run.flags.has(PoseFlag::wrong_handedness));
    EXPECT_EQ(run.valid_within, 0);
}

TEST(FixedTrackerFault, Dropout) {
    const FaultRun run = play("dropped_blocks:1");
    EXPECT_TRUE(run.flags.has(PoseFlag::stale));
    EXPECT_LT(run.first_invalid_s, 0.12);
    EXPECT_EQ(run.state_at_end, TrackerState::lost);
    EXPECT_NEAR(run.counters.lost_blocks, 360, 2);
}

TEST(FixedTrackerFault, HalfOfTheBlocksDropped) {
    const FaultRun run = play("dropped_blocks:0.5");
    EXPECT_GT(run.counters.lost_blocks, 100U);
}

TEST(FixedTrackerFault, LongDropoutForgetsThePose) {
    const FaultRun run = play("dropped_blocks:1", 0.5, 2);
    EXPECT_EQ(run.state_at_end, TrackerState::searching);
    EXPECT_EQ(run.counters.acquisitions, 2U);
}

struct AfterLoss {
    int valid = 0;
    int unknown = 0;
    int wrong = 0;      // valid, yet on the other side
    int different = 0;  // hemisphere known to only one of the trackers
};

AfterLoss lose_within(const sim::Motion& motion, double begin_s, double end_s) {
    Pair pair(signal::Multiplexing::tdm, motion, {},
              {host::parse_fault("dropped_blocks:1@" + std::to_string(begin_s) + "-" + std::to_string(end_s))});
    AfterLoss seen;
    while (pair.elapsed_s() < end_s + 0.5) {
        const auto [exact, ours, arrived] = pair.step();
        if (!ours || !exact || pair.elapsed_s() < end_s + 0.02) {
            continue;
        }
        const bool unknown = ours->flags.has(PoseFlag::hemisphere_unknown);
        seen.valid += ours->valid() ? 1 : 0;
        seen.unknown += unknown ? 1 : 0;
        seen.different += unknown == exact->flags.has(PoseFlag::hemisphere_unknown) ? 0 : 1;
        const Vec3<double> off = to_double(ours->position_m) - motion.at(pair.elapsed_s()).position_m;
        seen.wrong += ours->valid() && off.norm() > 0.05 ? 1 : 0;
    }
    return seen;
}

void expect_unknown(const AfterLoss& seen) {
    EXPECT_EQ(seen.valid, 0);
    EXPECT_GT(seen.unknown, 300);
    EXPECT_EQ(seen.different, 0);
}

TEST(FixedHemisphere, IsNotTakenFromTheSettingAfterALoss) {
    expect_unknown(lose_within(test::walked_behind(), 1.2, 2.4));
    expect_unknown(lose_within(test::moved({0.5, 0, 0.05}, {-0.3, 0.4, 0.05}, 0.5, 1), 0.5, 1));
}

TEST(FixedHemisphere, StaysKnownThroughALossTooShortToCrossTheBoundary) {
    const AfterLoss seen = lose_within(test::moved({0.5, 0, 0.05}, {0.5, 0.2, 0.05}, 0.5, 0.7), 0.5, 0.7);
    EXPECT_GT(seen.valid, 300);
    EXPECT_EQ(seen.unknown + seen.wrong + seen.different, 0);
}

/// The integer decision equals that of double for a time without poses that differs by at most 2 us.
TEST(FixedSides, EqualThoseOfDouble) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> entry(-1.2, 1.2);
    std::uniform_int_distribution<std::int64_t> age(0, 600'000);
    using Real = tracking::Sides<double>;
    int excluded = 0;
    for (int n = 0; n < 100'000; ++n) {
        const Vec3<double> a(entry(random), entry(random), entry(random));
        Vec3<double> b(entry(random), entry(random), entry(random));
        b *= a.dot(b) < 0 ? -1 : 1;
        const Microseconds unseen{age(random)};
        const auto fixed = [](const Vec3<double>& v) -> Vec3<Metres> {
            return v.unaryExpr([](double e) { return Metres::from(e); });
        };
        const bool answer = Sides::is_mirror_excluded(fixed(a), fixed(b), unseen);
        const bool shorter = Real::is_mirror_excluded(a, b, unseen - Microseconds{2});
        const bool longer = Real::is_mirror_excluded(a, b, unseen + Microseconds{2});
        excluded += answer ? 1 : 0;
        ASSERT_TRUE(answer == shorter || answer == longer)
            << eigen(a).transpose() << " / " << eigen(b).transpose() << " " << unseen.count();
        ASSERT_EQ(Sides::are_opposite(fixed(a), fixed(-b)), a.dot(-b) < 0);
    }
    EXPECT_GT(excluded, 20'000);
    EXPECT_FALSE(Sides::is_mirror_excluded(Vec3<Metres>::Zero(), Vec3<Metres>::Zero(), Microseconds{0}));
    const Vec3<Metres> corner(Metres::smallest(), Metres::largest(), Metres::largest());
    EXPECT_TRUE(Sides::is_mirror_excluded(corner, corner, Microseconds{1}));
    EXPECT_FALSE(Sides::is_mirror_excluded(corner, corner, Microseconds::max()));
}

}  // namespace
}  // namespace tricoil::fixed
