// The flash image boots, passes its self-check, tracks the simulated hand on all three links, with equal results in every run.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "board/nucleo_g474re/measuring.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/virtual_board/board_bench.hpp"
#include "tests/virtual_board/circuit_budget.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::BoardBench;

constexpr std::uint8_t kPassed = 0;
constexpr std::uint8_t kAbsent = 2;
constexpr double kSettleS = 0.5;

/// Processor load: share of the cycles since the last call in which the processor did not sleep.
class LoadMeter {
public:
    explicit LoadMeter(const virtual_board::VirtualBoard& board) : cpu_(board.machine.cpu) { take(); }
    double take() {
        const std::uint64_t busy = cpu_.busy_cycles() - std::exchange(busy_, cpu_.busy_cycles());
        const std::uint64_t cycles = cpu_.cycles() - std::exchange(cycles_, cpu_.cycles());
        return cycles == 0 ? 0 : static_cast<double>(busy) / static_cast<double>(cycles);
    }

private:
    const virtual_board::Cpu& cpu_;
    std::uint64_t busy_ = 0;
    std::uint64_t cycles_ = 0;
};

struct Score {
    std::size_t valid = 0;
    std::size_t invalid = 0;
    unsigned flags = 0;  // of the invalid poses
    double rms_mm = 0;
    double worst_mm = 0;
    double stated_mm = 0;    // RMS of the predicted errors
    double frame_mm = 0;     // RMS expected of single frames of a sensor at rest without filter, by the noise budget
    double frame_share = 0;  // median ratio of the predicted errors to those of single frames
};

/// Expected square of a single frame's position error at this range, mm^2, by the noise of the circuits.
double frame_error_mm2(double range_m, std::size_t mode) {
    static const test::CircuitBudget budget;
    return std::pow(budget.noise_mm(range_m, mode), 2);
}

Score score(const sim::Scenario& scenario, const std::vector<protocol::PoseMessage>& poses, std::size_t mode,
            double clock_begin_s) {
    Score s;
    double squares = 0;
    double stated = 0;
    double frame = 0;
    std::vector<double> shares;
    for (const protocol::PoseMessage& pose : poses) {
        if (pose.time_us < poses.front().time_us + static_cast<std::int64_t>(1e6 * kSettleS)) {
            continue;
        }
        tracking::PoseEstimate<double> estimate;
        EXPECT_EQ(protocol::from_message(pose, estimate), protocol::WireError::none);
        const auto truth = scenario.motion->at(1e-6 * static_cast<double>(pose.time_us) + clock_begin_s);
        const double error_mm = 1e3 * (estimate.position_m - truth.position_m).norm();
        ++(estimate.valid() ? s.valid : s.invalid);
        s.flags |= estimate.valid() ? 0U : pose.flags;
        s.worst_mm = std::max(s.worst_mm, error_mm);
        squares += error_mm * error_mm;
        const double stated_mm2 = 1e6 * estimate.covariance.topLeftCorner<3, 3>().trace();
        const double frame_mm2 = frame_error_mm2(truth.position_m.norm(), mode);
        stated += stated_mm2;
        frame += frame_mm2;
        shares.push_back(std::sqrt(stated_mm2 / frame_mm2));
    }
    const auto count = static_cast<double>(std::max<std::size_t>(s.valid + s.invalid, 1));
    s.rms_mm = std::sqrt(squares / count);
    s.stated_mm = std::sqrt(stated / count);
    s.frame_mm = std::sqrt(frame / count);
    std::nth_element(shares.begin(), shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2), shares.end());
    s.frame_share = shares.empty() ? 0 : shares[shares.size() / 2];
    return s;
}

/// Compares poses after the first half second with the truth at their times. The board's clock starts a few milliseconds after
/// power-on; the offset is fitted to the first 1440 poses.
Score score(const sim::Scenario& scenario, const std::vector<protocol::PoseMessage>& poses, std::size_t mode = 0) {
    const auto end = poses.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(poses.size(), 1440));
    const std::vector<protocol::PoseMessage> first(poses.begin(), end);
    double best_begin_s = 0;
    double best_mm = std::numeric_limits<double>::infinity();
    for (double begin_s = 0; begin_s < 6e-3; begin_s += 0.1e-3) {
        const double rms_mm = score(scenario, first, mode, begin_s).rms_mm;
        best_begin_s = rms_mm < best_mm ? begin_s : best_begin_s;
        best_mm = std::min(best_mm, rms_mm);
    }
    return score(scenario, poses, mode, best_begin_s);
}

/// Errors exceed the predicted errors by at most 30 %, and these the noise budget of single frames by at most 30 % (median:
/// after a manoeuvre the filter states larger errors for some frames).
void expect_accurate(const Score& s) {
    std::printf("RMS %.2f mm, stated %.2f, a still frame without filter %.2f (median ratio %.2f), worst %.2f\n", s.rms_mm,
                s.stated_mm, s.frame_mm, s.frame_share, s.worst_mm);
    EXPECT_LT(s.rms_mm, 1.3 * s.stated_mm);
    EXPECT_LT(s.frame_share, 1.3);
}

std::size_t lost(const std::vector<protocol::PoseMessage>& poses) {
    std::size_t gaps = 0;
    for (std::size_t n = 1; n < poses.size(); ++n) {
        gaps += poses[n].sequence - poses[n - 1].sequence - 1;
    }
    return gaps;
}

/// Blocks without a pose: a change of the drive skips one. Expects no other gap.
std::size_t skipped_blocks(const std::vector<protocol::PoseMessage>& poses, double block_s) {
    std::size_t skipped = 0;
    for (std::size_t n = 1; n < poses.size(); ++n) {
        const long blocks = std::lround(1e-6 * static_cast<double>(poses[n].time_us - poses[n - 1].time_us) / block_s);
        EXPECT_TRUE(blocks == 1 || blocks == 2) << blocks << " blocks at " << poses[n].time_us << " us";
        skipped += blocks == 2 ? 1U : 0U;
    }
    return skipped;
}

bool same(const protocol::PoseMessage& a, const protocol::PoseMessage& b) {
    return a.time_us == b.time_us && a.position == b.position && a.quaternion == b.quaternion && a.deviation == b.deviation &&
           a.flags == b.flags && a.distortion == b.distortion;
}

/// Expects that poses of two links with equal times are equal.
void expect_same(const std::vector<protocol::PoseMessage>& some, const std::vector<protocol::PoseMessage>& all) {
    std::size_t compared = 0;
    auto at = all.begin();
    for (const protocol::PoseMessage& pose : some) {
        at = std::find_if(at, all.end(), [&](const protocol::PoseMessage& p) { return p.time_us >= pose.time_us; });
        if (at != all.end() && at->time_us == pose.time_us) {
            ASSERT_TRUE(same(pose, *at)) << pose.time_us;
            ++compared;
        }
    }
    EXPECT_GT(compared + 30, some.size());
}

TEST(Tracker, BootsAndIdentifiesItselfOnEveryLink) {
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    for (std::size_t link = 0; link < test::link_numbers; ++link) {
        bench.host(link).hello();
    }
    bench.run(0.1);
    for (std::size_t link = 0; link < test::link_numbers; ++link) {
        ASSERT_EQ(bench.host(link).identities.size(), 1U) << "link " << link;
        EXPECT_EQ(bench.host(link).identities[0].role, static_cast<std::uint8_t>(protocol::Role::tracker));
    }
    EXPECT_FALSE(bench.board->bench.any_driven());
    EXPECT_EQ(bench.board->resets(), 0U);
}

TEST(Tracker, PassesItsSelfCheck) {
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    bench.host().hello();
    bench.run(0.05);
    bench.host().command(Opcode::self_check);
    bench.run(1);
    ASSERT_GT(bench.host().checks.size(), 5U);
    for (const auto& check : bench.host().checks) {
        EXPECT_TRUE(check.outcome == kPassed || check.outcome == kAbsent) << "check " << check.id << ": " << check.measured;
    }
    EXPECT_EQ(bench.status().faults & static_cast<unsigned>(protocol::Fault::self_check), 0U);
}

TEST(Tracker, TracksTheHandOnAllLinks) {
    BoardBench bench;
    bench.start({test::on_serial, test::on_can, test::on_usb});
    bench.run(2);
    const auto& poses = bench.host(test::on_serial).poses;
    const Score s = score(bench.scenario, poses);
    std::printf("%zu valid poses, %zu others\n", s.valid, s.invalid);
    expect_accurate(s);
    EXPECT_GT(s.valid, 1000U);
    EXPECT_EQ(s.invalid, 0U);
    EXPECT_LT(s.worst_mm, 5 * s.stated_mm);
    EXPECT_EQ(lost(poses), 0U);
    expect_same(bench.host(test::on_can).poses, poses);
    expect_same(bench.host(test::on_usb).poses, poses);
}

TEST(Tracker, WrongExcitationGivesWrongPoses) {
    BoardBench bench("hand", {"swapped_coils:S1,S2"});
    bench.start({test::on_serial});
    bench.run(0.8);
    const Score s = score(bench.scenario, bench.host().poses);
    EXPECT_TRUE(s.valid == 0 || s.worst_mm > 50) << s.worst_mm;
}

TEST(Tracker, GivesEqualOutputInThreeRuns) {
    std::vector<std::uint64_t> hashes;
    for (int n = 0; n < 3; ++n) {
        BoardBench bench;
        bench.start({test::on_serial, test::on_can});
        bench.run(0.3);
        EXPECT_GT(bench.hash.bytes(), 10000U);
        hashes.push_back(bench.hash.value());
    }
    EXPECT_EQ(hashes[0], hashes[1]);
    EXPECT_EQ(hashes[1], hashes[2]);
}

struct MeasuringMode {
    const char* name;
    protocol::ModeRequest request;
    std::size_t mode;    // of the board
    double poses_per_s;  // TDM: one per column, FDM: one per frame
};

class ModeOfTheBoard : public ::testing::TestWithParam<MeasuringMode> {};

/// Every mode tracks without losses and leaves processor time unused. An instruction counts as one cycle (see sim/virtual_board).
TEST_P(ModeOfTheBoard, TracksWithTimeToSpare) {
    const auto& [name, request, mode, expected_per_s] = GetParam();
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    bench.host(test::on_usb).hello();
    bench.run(0.01);
    ASSERT_EQ(bench.ask(test::on_usb, Opcode::mode, protocol::mode_argument(request)), AckResult::done);
    ASSERT_EQ(bench.ask(test::on_usb, Opcode::start), AckResult::done);
    bench.fed[test::on_usb] = true;
    bench.run(0.2);
    LoadMeter load(*bench.board);
    const std::size_t before = bench.host(test::on_usb).poses.size();
    bench.run(1);
    const double share = load.take();
    const auto& poses = bench.host(test::on_usb).poses;
    const double poses_per_s = static_cast<double>(poses.size() - before);
    const Score s = score(bench.scenario, poses, mode);
    std::printf("%s: CPU load %.1f %%, %.0f poses in a second, worst interrupt latency %.2f us\n", name, 100 * share, poses_per_s,
                1e6 * virtual_board::worst_latency(*bench.board).seconds);
    EXPECT_LT(share, 0.9);
    EXPECT_NEAR(poses_per_s, expected_per_s, 0.01 * expected_per_s);
    EXPECT_EQ(lost(poses), 0U);
    expect_accurate(s);
    EXPECT_EQ(bench.status(test::on_usb).faults & ~static_cast<unsigned>(protocol::Fault::calibration), 0U);
}

INSTANTIATE_TEST_SUITE_P(Rates, ModeOfTheBoard,
                         ::testing::Values(MeasuringMode{"tdm_240", {240'000, signal::Multiplexing::tdm}, 0, 717.91},
                                           MeasuringMode{"fdm_240", {240'000, signal::Multiplexing::fdm}, 1, 239.30},
                                           MeasuringMode{"fdm_960", {960'000, signal::Multiplexing::fdm}, 2, 957.21},
                                           MeasuringMode{"tdm_480", {480'000, signal::Multiplexing::tdm}, 3, 1435.8},
                                           MeasuringMode{"two_bands", {240'000, signal::Multiplexing::dual_band}, 4, 239.30}),
                         [](const auto& instance) { return instance.param.name; });

/// Poses of the first 0.1 s in FDM, where every conversion of a block is used.
std::vector<protocol::PoseMessage> first_poses(std::uint32_t error_codes) {
    BoardBench bench;
    for (const unsigned number : {1U, 3U, 4U, 5U}) {
        bench.board->adc(number).set_first_error(error_codes);
    }
    bench.run(BoardBench::kBootS);
    bench.host(test::on_usb).hello();
    bench.run(0.01);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::mode, protocol::mode_argument({240'000, signal::Multiplexing::fdm})),
              AckResult::done);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::start), AckResult::done);
    bench.fed[test::on_usb] = true;
    bench.run(0.1);
    return bench.host(test::on_usb).poses;
}

/// ES0430 2.7.9 and 2.7.10: the first conversion after a start may be wrong. The main loop drops the blocks in which the coils
/// settle, with this conversion.
TEST(Tracker, PosesDoNotDependOnTheFirstConversionOfAStart) {
    const auto poses = first_poses(1024);
    const auto without_error = first_poses(0);
    ASSERT_GT(poses.size(), 10U);
    ASSERT_EQ(poses.size(), without_error.size());
    for (std::size_t n = 0; n < poses.size(); ++n) {
        EXPECT_TRUE(same(poses[n], without_error[n])) << n;
    }
}

/// Runs for TRICOIL_BOARD_S seconds (default 8; long test: 3600).
TEST(Tracker, TheReadingOfTheSupplyCostsAFrame) {
    BoardBench bench("still");
    bench.start({test::on_usb});
    bench.run(2.5);
    const auto& poses = bench.host(test::on_usb).poses;
    ASSERT_GT(poses.size(), 1700U);
    int gaps = 0;
    std::uint64_t longest_us = 0;
    for (std::size_t n = 1; n < poses.size(); ++n) {
        const std::uint64_t gap_us = poses[n].time_us - poses[n - 1].time_us;
        gaps += gap_us > 1500 ? 1 : 0;  // a slot takes 1393 us
        longest_us = std::max(longest_us, gap_us);
    }
    std::printf("longest gap %.2f ms\n", 1e-3 * static_cast<double>(longest_us));
    EXPECT_EQ(gaps, 2) << "once a second";
    EXPECT_LT(longest_us, 4179) << "a frame";
}

TEST(Tracker, RunsWithoutLoss) {
    const char* const wanted = std::getenv("TRICOIL_BOARD_S");
    const double duration_s = wanted == nullptr ? 8 : std::stod(wanted);
    BoardBench bench;
    bench.start({test::on_serial});
    LoadMeter load(*bench.board);
    bench.run(duration_s);
    const double share = load.take();
    const auto latency = virtual_board::worst_latency(*bench.board);
    const auto stack =
        virtual_board::stack_use(*bench.board, *bench.symbols.address_of("stack_bottom"), *bench.symbols.address_of("stack_top"));
    const auto& poses = bench.host().poses;
    const Score s = score(bench.scenario, poses);
    std::printf(
        "%zu poses in %.0f s, %zu invalid (flags %x), CPU load %.1f %%, worst interrupt latency %.2f us "
        "(interrupt "
        "%d), stack %u of %u "
        "bytes\n",
        poses.size(), duration_s, s.invalid, s.flags, 100 * share, 1e6 * latency.seconds, latency.interrupt, stack.used,
        stack.size);
    constexpr double kBlocksPerS = 717.905;
    const std::size_t skipped = skipped_blocks(poses, 1 / kBlocksPerS);
    EXPECT_NEAR(static_cast<double>(poses.size() + skipped), kBlocksPerS * duration_s, 10);
    EXPECT_EQ(lost(poses), 0U);
    EXPECT_LE(s.invalid, poses.size() / 1000)
        << "where noise or a change of gain contradicts the filter, one pose is unconfirmed";
    expect_accurate(s);
    EXPECT_LT(share, 0.6);
    EXPECT_LT(latency.seconds, 20e-6);
    EXPECT_LE(stack.used, 5120U) << "budget of the image, toolchain/budgets.toml";
    EXPECT_EQ(bench.status().faults & ~static_cast<unsigned>(protocol::Fault::calibration), 0U);
}

}  // namespace
}  // namespace tricoil
