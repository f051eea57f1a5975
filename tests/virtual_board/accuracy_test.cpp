// Accuracy of drawn boards: a sensor at rest at several ranges, after calibration by the product's own tools.
#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <random>

#include "board/nucleo_g474re/measuring.hpp"
#include "core/field/concentric_dipole.hpp"
#include "tests/virtual_board/circuit_budget.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

using signal::Multiplexing;
using test::at;
using test::calibrate;
using test::random_pose;
using virtual_board::BoardCircuit;

/// Sums of squares, mm^2, over all rests at one range.
struct AtRange {
    double noise = 0;
    double offset = 0;
    int rests = 0;
    [[nodiscard]] double noise_mm() const { return std::sqrt(noise / rests); }
    [[nodiscard]] double offset_mm() const { return std::sqrt(offset / rests); }
    [[nodiscard]] double total_mm() const { return std::hypot(noise_mm(), offset_mm()); }
};

constexpr auto& kRangesCm = test::CircuitBudget::kRangesCm;
constexpr int kPosesPerRange = 3;
constexpr int kCalibrationRests = 72;  // of a calibration
constexpr std::uint64_t kBoards = 6;
constexpr std::uint64_t kFdmBoards = 3;     // the first ones
constexpr double kWarmerK = 5 / 1.7320508;  // RMS of the temperature change of the budget

void add_board(std::uint64_t seed, Multiplexing multiplexing, std::map<int, AtRange>& sums) {
    const protocol::ModeRequest mode{240'000, multiplexing, true};
    const host::CalibrationFile calibrated = calibrate(BoardCircuit::draw(seed), mode, seed, kCalibrationRests);
    const calibration::Blob blob = calibration::encode(calibrated.calibration);
    std::mt19937_64 random(seed + 100);
    std::vector<sim::Pose> poses;
    for (const int cm : kRangesCm) {
        for (int n = 0; n < kPosesPerRange; ++n) {
            poses.push_back(random_pose(0.01 * cm, random));
        }
    }
    const auto frames =
        test::measure(BoardCircuit::draw(seed, kWarmerK), host::load_scenario("still", 1), mode, poses, &blob).frames;
    for (std::size_t n = 0; n < poses.size(); ++n) {
        ASSERT_GT(frames[n].size(), 20U) << n;
        host::PoseFile file;
        file.path = "rests";
        for (const test::RestFrame& frame : frames[n]) {
            file.poses.push_back(at(poses[n], frame.x - calibrated.calibration.pick_up.in_phase));
        }
        Vec3<double> mean = Vec3<double>::Zero();
        double squares = 0;
        const auto errors = evaluate(calibrated, {file}, host::EvaluationSolver::direct);
        for (const host::EvaluatedPose& e : errors) {
            EXPECT_TRUE(e.converged);
            mean += 1e3 * e.error_m / static_cast<double>(errors.size());
            squares += 1e6 * e.error_m.squaredNorm() / static_cast<double>(errors.size());
        }
        AtRange& sum = sums[kRangesCm[n / kPosesPerRange]];
        sum.noise += squares - mean.squaredNorm();
        sum.offset += mean.squaredNorm();
        ++sum.rests;
    }
}

/// The budget is the RMS of all boards that can be drawn; the RMS of a few differs by chance. Two standard errors of the RMS of
/// kBoards independent boards with three axes each.
const double kChance = 1 + 2 / std::sqrt(2.0 * 3 * kBoards);

constexpr int kGoalCm = 75;
constexpr double kGoalMm = 0.2;  // from all causes together

/// Prints the table of board/ACCURACY.md. TDM is compared with the budget. Noise: at most 30 % above; the budget is for the
/// largest possible coupling, so drive or gain may be one step of 2 higher and the noise half as large. Noise and offset
/// together: the budget with corrected converters and gain steps, and the goal at 0.75 m.
TEST(Accuracy, StillSensorOfDrawnBoards) {
    const test::CircuitBudget budget;
    std::map<Multiplexing, std::map<int, AtRange>> measured;
    for (std::uint64_t seed = 1; seed <= kBoards; ++seed) {
        add_board(seed, Multiplexing::tdm, measured[Multiplexing::tdm]);
        if (seed <= kFdmBoards) {
            add_board(seed, Multiplexing::fdm, measured[Multiplexing::fdm]);
        }
    }
    std::printf("| range, m | TDM noise, mm | offset, mm | budget: noise, mm | all causes, mm | FDM noise, mm | offset, mm |\n");
    for (const int cm : kRangesCm) {
        const AtRange& tdm = measured[Multiplexing::tdm][cm];
        const AtRange& fdm = measured[Multiplexing::fdm][cm];
        const double noise_mm = budget.noise_mm(cm);
        const double total_mm = budget.total_mm(cm);
        std::printf("| %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", 0.01 * cm, tdm.noise_mm(), tdm.offset_mm(), noise_mm,
                    total_mm, fdm.noise_mm(), fdm.offset_mm());
        EXPECT_LT(tdm.noise_mm(), 1.3 * noise_mm) << cm;
        EXPECT_GT(tdm.noise_mm(), noise_mm / 2 / 1.3) << cm;
        EXPECT_LT(tdm.total_mm(), kChance * total_mm) << cm;
    }
    const double at_goal_mm = measured[Multiplexing::tdm][kGoalCm].total_mm();
    std::printf("TDM at 0.75 m: %.3f mm from all causes together\n", at_goal_mm);
    EXPECT_LE(at_goal_mm, kGoalMm);
}

/// Pick-up of this share of the largest coupling at 0.75 m between each source coil and each channel, with random signs.
Mat3<double> drawn_pick_up(const BoardCircuit& circuit, double share) {
    std::mt19937_64 random(7);
    Mat3<double> pick_up;
    for (Index k = 0; k < 9; ++k) {
        const double per_ampere = 2e-7 * 2 * std::numbers::pi * 1e4 * circuit.source_m2[static_cast<std::size_t>(k % 3)] *
                                  circuit.sensor_m2[static_cast<std::size_t>(k / 3)] / std::pow(0.75, 3);
        pick_up(k / 3, k % 3) = (random() % 2 == 0 ? share : -share) * per_ampere;
    }
    return pick_up;
}

/// The wiring changes after the first calibration; the second one finds the pick-up.
TEST(Accuracy, PickUpIsCalibrated) {
    const protocol::ModeRequest mode{240'000, Multiplexing::tdm, true};
    constexpr std::uint64_t kSeed = 1;
    BoardCircuit circuit = BoardCircuit::draw(kSeed);
    circuit.pick_up = Mat3<double>::Zero();
    const host::CalibrationFile before = calibrate(circuit, mode, kSeed, kCalibrationRests);
    EXPECT_TRUE(before.calibration.pick_up.is_none());
    circuit.pick_up = drawn_pick_up(circuit, 4.2e-3);
    const host::CalibrationFile after = calibrate(circuit, mode, kSeed, kCalibrationRests);
    std::mt19937_64 random(kSeed + 200);
    std::vector<sim::Pose> poses;
    for (int n = 0; n < 6; ++n) {
        poses.push_back(random_pose(0.75, random));
    }
    for (const host::CalibrationFile* calibrated : {&before, &after}) {
        const calibration::Blob blob = calibration::encode(calibrated->calibration);
        const auto measured = test::measure(circuit, host::load_scenario("still", 1), mode, poses, &blob);
        double squares = 0;
        for (std::size_t n = 0; n < poses.size(); ++n) {
            host::PoseFile file;
            file.path = "rests";
            for (const test::RestFrame& frame : measured.frames[n]) {
                file.poses.push_back(at(poses[n], frame.x - calibrated->calibration.pick_up.in_phase));
            }
            for (const host::EvaluatedPose& e : evaluate(*calibrated, {file}, host::EvaluationSolver::direct)) {
                squares += 1e6 * e.error_m.squaredNorm() / static_cast<double>(poses.size() * file.poses.size());
            }
        }
        const bool is_calibrated = calibrated == &after;
        std::printf("0.42 %% pick-up at 0.75 m, %scalibrated: %.3f mm\n", is_calibrated ? "" : "not ", std::sqrt(squares));
        EXPECT_EQ(std::sqrt(squares) < 0.25, is_calibrated);
    }
}

/// The firmware's constants, the netlists and the virtual board agree; the nominal board needs no calibration.
TEST(Accuracy, NominalCouplingsAreThoseOfTheFirmware) {
    const sim::Scenario scenario = host::load_scenario("still", 1);
    const BoardCircuit circuit = BoardCircuit::draw(0);
    const virtual_board::CoilBench bench(scenario, circuit);
    const sim::Pose pose{Vec3<double>::UnitX(), Quat<double>::Identity()};
    const Mat3<double> x = bench.coupling(pose, nucleo_g474re::kModes[0].plan.params.carrier_hz[0]);
    const Mat3<double> unit = field::signal_matrix<double>(1, pose.position_m, Mat3<double>::Identity());
    for (int j = 0; j < kSourceCoils; ++j) {
        const double stated =
            double{nucleo_g474re::kCouplingConstant} * double{nucleo_g474re::kMoments[static_cast<std::size_t>(j)]};
        EXPECT_NEAR(x(j, j) / unit(j, j) / stated, 1, 1e-3) << j;
    }
}

}  // namespace
}  // namespace tricoil
