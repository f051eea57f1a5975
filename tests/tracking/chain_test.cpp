// The filter with samples, windows and demodulator: blur by windows of finite length, and the simulator's faults.
#include <gtest/gtest.h>

#include "sim/motion/simple_motions.hpp"
#include "tests/support/chain_run.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

using test::ChainParams;
using test::Score;

Score play(const sim::Motion& motion, bool tdm, bool filtered, bool noise, double duration_s) {
    ChainParams chain;
    chain.tdm = tdm;
    chain.filtered = filtered;
    chain.noise = noise;
    chain.duration_s = duration_s;
    return test::score_chain(motion, chain);
}

void expect_honest(const Score& score) {
    EXPECT_GT(score.count(), 500);
    EXPECT_LT(score.nees_position_per_dof(), 1.5);
    EXPECT_LT(score.nees_rotation_per_dof(), 1.5);
    EXPECT_LE(static_cast<double>(score.beyond_5_sigma), 1e-3 * score.count());
    EXPECT_EQ(score.invalid, 0U);
}

/// A window of 4 ms blurs the motion of a hand. The covariance must include this, with and without noise.
TEST(Blur, IsInTheCovariance) {
    for (const bool tdm : {false, true}) {
        for (const bool noise : {true, false}) {
            const auto motion = test::hand_like(3);
            const Score score = play(motion, tdm, true, noise, 5);
            std::printf("%s, %s: %.4f mm RMS, error^2 / covariance %.2f, turning %.2f, %zu of %.0f beyond 5 sigma, flags %x\n",
                        tdm ? "tdm" : "fdm", noise ? "noise" : "no noise", 1e3 * score.position().rms,
                        score.nees_position_per_dof(), score.nees_rotation_per_dof(), score.beyond_5_sigma, score.count(),
                        static_cast<unsigned>(score.flags.bits()));
            expect_honest(score);
        }
    }
}

/// The chi-square must allow for the blur of a fast hand, which otherwise looks like metal.
TEST(Blur, IsNotTakenForMetal) {
    ChainParams chain;
    chain.tdm = false;
    const auto motion = sim::HandMotion({0.5, 0, 0}, 2);
    std::size_t poses = 0;
    std::size_t distorted = 0;
    test::run_chain(motion, chain, [&](const auto& e, double) {
        if (to_seconds(e.time) > 0.5) {
            ++poses;
            distorted += e.flags.has(PoseFlag::distorted) ? 1U : 0U;
        }
    });
    EXPECT_GT(poses, 1000U);
    EXPECT_LT(distorted, poses / 100);
}

/// At 2,000 m/s^2 the error of the filter must be close to that of the direct solver with the same nine couplings.
TEST(Blur, DoesNotMisleadTheFilter) {
    sim::PaperRates rates;
    rates.azimuth_amplitude = 8 * 3.14159265358979323846;
    rates.elevation_amplitude = 1.5 * 3.14159265358979323846;
    const sim::PaperMotion motion(rates);
    const Score direct = play(motion, false, false, false, 5);
    const Score filtered = play(motion, false, true, false, 5);
    std::printf("direct %.3f mm RMS, %.3f mm max; filtered %.3f mm RMS, %.3f mm max, error^2 / covariance %.2f, invalid %zu\n",
                1e3 * direct.position().rms, 1e3 * direct.position().max, 1e3 * filtered.position().rms,
                1e3 * filtered.position().max, filtered.nees_position_per_dof(), filtered.invalid);
    EXPECT_LT(filtered.position().rms, 1.2 * direct.position().rms);
    EXPECT_LT(filtered.position().max, 1.5 * direct.position().max);
    EXPECT_LT(filtered.nees_position_per_dof(), 1.5);
    EXPECT_LT(static_cast<double>(filtered.invalid), 0.01 * filtered.count());
}

struct FaultCase {
    const char* fault;
    PoseFlag says;
    bool tdm;
};

class ChainFault : public ::testing::TestWithParam<FaultCase> {};

struct FaultRun {
    Score score;
    PoseFlags flags;  // during the fault
    double first_flag_s = 1e9;
    double valid_again_s = 1e9;
    double longest_silence_s = 0;
    std::size_t far_unflagged = 0;  // valid poses 5 cm off without the flag distorted
    std::size_t far_after = 0;      // valid poses 5 cm off after the fault's end
};

/// The run lasts 4 s; the fault lasts from 2 s to 3 s.
FaultRun play_fault(const FaultCase& fault, bool filtered, std::uint64_t seed) {
    const auto motion = sim::HandMotion({0.6, 0, 0}, seed);
    ChainParams chain;
    chain.tdm = fault.tdm;
    chain.filtered = filtered;
    chain.duration_s = 4;
    chain.seed = seed;
    chain.confined = true;
    chain.faults = {std::string(fault.fault) + "@2-3"};
    FaultRun run;
    double last_s = 0.1;
    test::run_chain(motion, chain, [&](const PoseEstimate<double>& e, double now_s) {
        const double t = to_seconds(e.time);
        run.score.add(e, motion, 0);
        run.longest_silence_s = std::max(run.longest_silence_s, now_s - last_s);
        last_s = now_s;
        if (now_s >= 2 && now_s < 3) {
            run.flags |= e.flags;
            run.first_flag_s =
                e.valid() && !e.flags.has(PoseFlag::coasting) ? run.first_flag_s : std::min(run.first_flag_s, now_s - 2);
        }
        run.valid_again_s = now_s >= 3 && e.valid() ? std::min(run.valid_again_s, now_s - 3) : run.valid_again_s;
        if (e.valid() && (e.position_m - motion.at(t).position_m).norm() > 0.05) {
            run.far_unflagged += e.flags.has(PoseFlag::distorted) ? 0U : 1U;
            run.far_after += now_s >= 3 ? 1U : 0U;
        }
    });
    return run;
}

/// Each fault of the simulator for one second: flagged within 50 ms; poses are valid again within 50 ms after the fault; at most
/// 0.1 % of the valid poses are beyond 5 sigma.
TEST_P(ChainFault, IsFlaggedAndValidPosesAreRight) {
    for (const std::uint64_t seed : {3U, 5U}) {
        const FaultRun run = play_fault(GetParam(), true, seed);
        std::printf("%s: %zu of %.0f valid poses beyond 5 sigma, largest error %.1f mm, flags %x\n", GetParam().fault,
                    run.score.beyond_5_sigma, run.score.count(), 1e3 * run.score.position().max,
                    static_cast<unsigned>(run.flags.bits()));
        EXPECT_LT(run.first_flag_s, 0.05);
        EXPECT_LT(run.valid_again_s, 0.05);
        EXPECT_LT(run.longest_silence_s, 0.05);
        EXPECT_TRUE(run.flags.has(GetParam().says)) << run.flags.bits();
        EXPECT_LE(static_cast<double>(run.score.beyond_5_sigma), 1e-3 * run.score.count());
    }
}

/// The deskewed direct solver cannot predict, so it cannot refuse a first bad column; it flags the misfit. Poses after the fault
/// must be good again.
TEST_P(ChainFault, LeavesTheDirectSolverAsItWas) {
    const FaultRun run = play_fault(GetParam(), false, 3);
    EXPECT_EQ(run.far_unflagged, 0U);
    EXPECT_EQ(run.far_after, 0U);
    EXPECT_LT(run.valid_again_s, 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    Simulator, ChainFault,
    ::testing::Values(
        FaultCase{"open_coil:S1", PoseFlag::no_reference, true}, FaultCase{"open_coil:S2", PoseFlag::no_reference, true},
        FaultCase{"open_coil:S3", PoseFlag::no_reference, true}, FaultCase{"open_coil:S2", PoseFlag::no_reference, false},
        FaultCase{"reversed_coil:S1", PoseFlag::wrong_handedness, true},
        FaultCase{"reversed_coil:C2", PoseFlag::wrong_handedness, true},
        FaultCase{"reversed_coil:S1", PoseFlag::wrong_handedness, false},
        FaultCase{"swapped_coils:S1,S2", PoseFlag::wrong_handedness, true},
        FaultCase{"stuck_channel:C3", PoseFlag::no_sensor, true}, FaultCase{"stuck_channel:R", PoseFlag::no_reference, true},
        FaultCase{"dropped_blocks:1", PoseFlag::stale, true}, FaultCase{"dropped_blocks:0.5", PoseFlag::coasting, true},
        FaultCase{"dropped_blocks:1", PoseFlag::stale, false}, FaultCase{"unplugged", PoseFlag::unconfirmed, true},
        FaultCase{"overload:1", PoseFlag::saturated, true}, FaultCase{"overload:1.5", PoseFlag::saturated, false},
        FaultCase{"overload:40", PoseFlag::saturated, true}));

}  // namespace
}  // namespace tricoil::tracking
