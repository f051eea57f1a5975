// The gain follows the distance, with hysteresis. Changes of the gain step do not appear in the couplings.
#include "board/app/gain_ranging.hpp"

#include <gtest/gtest.h>

#include "core/protocol/convert.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using app::GainRanging;
using test::DeviceBench;

signal::GainSteps<float> fours() {
    signal::GainSteps<float> steps{};
    for (std::size_t n = 0; n < 4; ++n) {
        steps[n].gain.fill(std::pow(4.0F, static_cast<float>(n)));
    }
    return steps;
}

TEST(GainRanging, GoesDownAtOnceAndUpWithPatience) {
    GainRanging ranging(fours(), 4);
    for (int n = 0; n < 17; ++n) {
        EXPECT_EQ(ranging.next(0.1F, 0), 0);
    }
    EXPECT_EQ(ranging.next(0.1F, 0), 1);
    EXPECT_EQ(ranging.next(0.9F, 1), 0);
}

TEST(GainRanging, LargeBlockRestartsThePatience) {
    GainRanging ranging(fours(), 4);
    for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(ranging.next(n % 10 == 0 ? 0.3F : 0.1F, 0), 0);
    }
}

TEST(GainRanging, IgnoresBlocksFromBeforeAChange) {
    GainRanging ranging(fours(), 4);
    for (int n = 0; n < 18; ++n) {
        ranging.next(0.1F, 0);
    }
    ASSERT_EQ(ranging.step(), 1);
    for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(ranging.next(0.95F, 0), 1);
    }
}

/// Steps 0 and 1 have less drive; the sensor comes near and goes away again.
TEST(GainRanging, ReducesTheDriveBelowTheLowestGain) {
    signal::GainSteps<float> steps{};
    steps[0].drive = 0.25F;
    steps[1].drive = 0.5F;
    steps[3].gain.fill(2);
    GainRanging ranging(steps, 4);
    EXPECT_EQ(ranging.step(), 2) << "full drive, lowest gain";
    EXPECT_EQ(ranging.next(1, 2), 1);
    EXPECT_EQ(ranging.next(1, 1), 0);
    EXPECT_EQ(ranging.next(1, 0), 0);
    for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(ranging.next(0.3F, 0), 0) << "0.6 of full scale at the next drive";
    }
    for (int n = 0; n < 3 * 18; ++n) {
        ranging.next(0.2F, ranging.step());
    }
    EXPECT_EQ(ranging.step(), 3);
}

/// No signal amplitude makes the gain oscillate.
TEST(GainRanging, HasHysteresis) {
    for (float volts = 0.001F; volts < 1; volts *= 1.01F) {
        GainRanging ranging(fours(), 4);
        int changes = 0;
        for (int n = 0; n < 1000; ++n) {
            const std::uint8_t before = ranging.step();
            changes += ranging.next(std::min(1.0F, volts * fours()[before].gain[0]), before) != before ? 1 : 0;
        }
        EXPECT_LE(changes, 3) << volts;
        const float share = volts * fours()[ranging.step()].gain[0];
        EXPECT_TRUE(share <= 0.85F || ranging.step() == 0) << volts;
        EXPECT_TRUE(share > 0.55F / 4 || ranging.step() == 3) << volts;
    }
}

TEST(GainRanging, StaysWithinTheAvailableSteps) {
    GainRanging one(fours(), 1);
    for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(one.next(0.001F, 0), 0);
        EXPECT_EQ(one.next(1, 0), 0);
    }
}

/// Gains and lags of a real amplifier; gains up to 3 % off their nominal values.
signal::GainSteps<double> real_amplifier() {
    signal::GainSteps<double> steps{};
    for (std::size_t n = 0; n < 4; ++n) {
        const double nominal = std::pow(4.0, static_cast<double>(n));
        steps[n].gain = {nominal * 1.02, nominal * 0.985, nominal * (n == 2 ? 1.03 : 0.99)};
        steps[n].lag_s.fill(nominal / (2 * std::numbers::pi * 13e6));  // for a gain-bandwidth product of 13 MHz
    }
    return steps;
}

/// Sensor on a straight line away from the source, 0.2 to 1.2 m.
class Away final : public sim::Motion {
    [[nodiscard]] sim::Pose do_at(double time_s) const override {
        const double range = std::min(0.2 + 0.25 * time_s, 1.2);
        const Vec3<double> towards = Vec3<double>(0.8, 0.5, -0.33).normalized();
        return {range * towards, Quat<double>(0.9, 0.2, -0.3, 0.1).normalized()};
    }
};

struct Seen {
    Column<float> column;
    std::uint8_t step = 0;
    double truth_ratio = 0;  // norm of the column relative to the true column
};

std::vector<Seen> columns_along(const signal::AcquisitionPlan& plan, const signal::GainSteps<double>& truth,
                                const signal::GainSteps<double>& calibrated) {
    const Away motion;
    sim::WorldParams params;
    params.converter.bits = 16;
    params.converter.noise_v_per_sqrt_hz = 200e-9;
    params.mains_v = 0;
    sim::CoilWorld world(params, motion, {});
    world.configure(plan);
    sim::SimulatedClock clock;
    sim::SimulatedCoilDriver coils;
    sim::SimulatedGain gain(truth, 4);
    sim::SimulatedCoilSampler sampler(world, coils, clock, 1e9);
    sampler.amplify(gain);
    auto demodulation = world.demodulation();
    demodulation.gain_steps = calibrated;
    const auto single = sim::in_single(demodulation);
    sim::SimulatedHeartbeat heart;
    app::SupervisedSampler supervised(sampler, gain, heart, single.gain_steps, 10);
    signal::Demodulator<float> demodulator(plan, single);
    std::vector<Seen> seen;
    EXPECT_TRUE(supervised.start(plan).ok());
    for (int n = 0; clock.elapsed_s() < 4; ++n) {
        EXPECT_TRUE(coils.excite(plan.is_tdm() ? single_coil(n % 3) : Excitation::all).ok());
        SampleBlock block;
        EXPECT_TRUE(supervised.poll(block).ok());
        const auto columns = demodulator.demodulate(block);
        EXPECT_TRUE(columns.ok());
        for (const Column<float>& column : *columns) {
            const Mat3<double> x = world.coupling(motion.at(to_seconds(column.midpoint)));
            const Vec3<double> real = x.col(coil_index(column.state));
            seen.push_back({column, block.gain_step, static_cast<double>(column.in_phase.norm()) / real.norm()});
        }
    }
    return seen;
}

struct Change {
    double before = 0;
    double after = 0;
};

/// Mean ratio to the truth of the last usable column before, and the first usable column after, each change of the step.
std::vector<Change> changes_in(const std::vector<Seen>& all) {
    std::vector<Seen> seen;
    for (const Seen& one : all) {
        if (!one.column.flags.has(ColumnFlag::gain_changed) && !one.column.flags.has(ColumnFlag::saturated)) {
            seen.push_back(one);
        }
    }
    constexpr std::size_t kMean = 60;
    std::vector<Change> changes;
    for (std::size_t n = kMean; n + kMean < seen.size(); ++n) {
        if (seen[n].step == seen[n - 1].step) {
            continue;
        }
        Change change;
        for (std::size_t k = 0; k < kMean; ++k) {
            change.before += seen[n - 1 - k].truth_ratio / kMean;
            change.after += seen[n + k].truth_ratio / kMean;
        }
        changes.push_back(change);
    }
    return changes;
}

class Amplified : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Amplified, ColumnsDoNotJumpWhenTheGainChanges) {
    const auto seen = columns_along(test::kBenchModes[GetParam()], real_amplifier(), real_amplifier());
    EXPECT_EQ(seen.back().step, 3) << "1.2 m needs the largest gain";
    const auto changes = changes_in(seen);
    ASSERT_GE(changes.size(), 3U);
    ASSERT_LE(changes.size(), 6U);
    for (const Change& change : changes) {
        EXPECT_NEAR(change.after / change.before, 1, 1e-3);
        EXPECT_NEAR(change.after, 1, 2e-3);
    }
}

TEST_P(Amplified, ColumnsDoJumpWithoutACalibrationOfTheSteps) {
    auto nominal = real_amplifier();
    for (std::size_t n = 0; n < 4; ++n) {
        nominal[n].gain.fill(std::pow(4.0, static_cast<double>(n)));
    }
    double largest = 0;
    for (const Change& change : changes_in(columns_along(test::kBenchModes[GetParam()], real_amplifier(), nominal))) {
        largest = std::max(largest, std::abs(change.after / change.before - 1));
    }
    EXPECT_GT(largest, 3e-3);
}

INSTANTIATE_TEST_SUITE_P(Multiplexing, Amplified, ::testing::Values(0, 1));

TEST(Amplified, LagTurnsCouplingsIntoQuadratureUnlessItIsCalibrated) {
    auto without_lag = real_amplifier();
    for (auto& step : without_lag) {
        step.lag_s.fill(0);
    }
    const auto quadrature = [](const std::vector<Seen>& seen) {
        double sum = 0;
        for (const Seen& one : seen) {
            sum += one.step == 3 ? std::abs(static_cast<double>(one.column.quadrature.norm() / one.column.in_phase.norm())) : 0;
        }
        return sum;
    };
    const double calibrated = quadrature(columns_along(test::kBenchModes[0], real_amplifier(), real_amplifier()));
    const double ignored = quadrature(columns_along(test::kBenchModes[0], real_amplifier(), without_lag));
    EXPECT_GT(ignored, 3 * calibrated);
}

/// RMS position error of a board after the first half second, mm.
double tracking_error_mm(DeviceBench& board) {
    board.boot();
    board.track();
    board.run(2.5);
    double squares = 0;
    double count = 0;
    const auto& poses = board.host().poses;
    for (const protocol::PoseMessage& m : poses) {
        tracking::PoseEstimate<double> estimate;
        EXPECT_EQ(protocol::from_message(m, estimate), protocol::WireError::none);
        if (m.time_us > poses.front().time_us + 500'000) {
            squares +=
                (estimate.position_m - board.scenario.motion->at(1e-6 * static_cast<double>(m.time_us)).position_m).squaredNorm();
            ++count;
        }
    }
    EXPECT_GT(count, 1000);
    EXPECT_GT(board.gain.step(), 0);
    return 1e3 * std::sqrt(squares / count);
}

TEST(Amplified, MeasuredStepsReduceTheTrackingError) {
    const test::BenchParams params{.scenario = "hand", .gains = real_amplifier(), .gain_steps = 4, .converter_bits = 16};
    DeviceBench measured(params);
    DeviceBench stated(params);
    stated.gain.disable_measurement();
    const double error_mm = tracking_error_mm(measured);
    EXPECT_LT(error_mm, 1);
    const auto& poses = measured.host().poses;
    const auto is_valid = [](const protocol::PoseMessage& m) { return (m.flags & 0x3FFU) == 0; };
    EXPECT_GT(static_cast<std::size_t>(std::count_if(poses.begin(), poses.end(), is_valid)), poses.size() * 9 / 10);
    EXPECT_GT(tracking_error_mm(stated), 3 * error_mm);
}

struct BrokenAmplifier : ::testing::Test {
    BrokenAmplifier() : board({.gains = real_amplifier(), .gain_steps = 4}) {
        board.gain.fail_with({StatusCode::degenerate, "gain is not as stated"});
        board.boot();
        board.run(0.01);
        for (std::size_t n = 0; n < DeviceBench::kLinks; ++n) {
            board.host(n).hello();
        }
        board.run(0.01);
    }
    static constexpr double kPause_s = 1.1;
    DeviceBench board;
};

TEST_F(BrokenAmplifier, IsReportedAtBootAndPreventsStartsUntilRepaired) {
    EXPECT_TRUE(board.device->faults().has(protocol::Fault::converter));
    EXPECT_EQ(board.ask(protocol::Opcode::start), protocol::AckResult::busy);
    board.run(kPause_s);
    EXPECT_EQ(board.ask(protocol::Opcode::start), protocol::AckResult::failed);
    EXPECT_TRUE(board.device->faults().has(protocol::Fault::converter));
    EXPECT_EQ(board.coils.changes(), 0U);
    board.gain.fail_with({});
    board.run(kPause_s);
    EXPECT_EQ(board.ask(protocol::Opcode::start), protocol::AckResult::done);
    EXPECT_FALSE(board.device->faults().has(protocol::Fault::converter));
}

TEST_F(BrokenAmplifier, IsMeasuredOnceForManyStarts) {
    board.run(kPause_s);
    const int before = board.gain.attempts();
    for (int n = 0; n < 8; ++n) {
        for (std::size_t link = 0; link < DeviceBench::kLinks; ++link) {
            board.host(link).start();
        }
    }
    board.run(0.1);
    EXPECT_EQ(board.gain.attempts(), before + 1);
}

TEST_F(BrokenAmplifier, CurrentDuringTheMeasurementIsReportedAsOverCurrent) {
    board.gain.fail_with({StatusCode::over_current, "over-current"});
    board.run(kPause_s);
    EXPECT_EQ(board.ask(protocol::Opcode::start), protocol::AckResult::failed);
    EXPECT_TRUE(board.device->faults().has(protocol::Fault::overcurrent));
    EXPECT_FALSE(board.device->faults().has(protocol::Fault::converter));
}

/// A constexpr plan equals the one that plan_acquisition() computes.
TEST(StatedPlan, EqualsThePlannedOne) {
    for (const signal::AcquisitionPlan& stated : test::kBenchModes) {
        const auto planned = signal::plan_acquisition(stated.params);
        ASSERT_TRUE(planned.ok()) << planned.status().message();
        EXPECT_EQ(planned->block_samples, stated.block_samples);
        EXPECT_EQ(planned->window_samples, stated.window_samples);
        EXPECT_EQ(planned->window_cycles, stated.window_cycles);
        EXPECT_EQ(planned->params.carrier_hz, stated.params.carrier_hz);
    }
}

}  // namespace
}  // namespace tricoil
