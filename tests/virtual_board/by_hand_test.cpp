// Calibration of drawn boards by hand, with the commands of BRING-UP.md: marks on a board, rests anywhere, no stage.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "tests/cli/cli_runner.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

using virtual_board::BoardCircuit;

constexpr protocol::ModeRequest kMode{240'000, signal::Multiplexing::tdm, true};
constexpr double kSpacing_m = 0.1;
constexpr double kHand_m = 0.3e-3;  // error of a mark and of the hand, along each axis
constexpr int kNodes = 24;
constexpr int kAttitudes = 3;  // at each node
constexpr int kAnywhere = 72;  // rests
constexpr std::uint64_t kBoards = 3;
constexpr double kWarmerK = 5 / 1.7320508;  // as in accuracy_test.cpp
constexpr double kGoalMm = 0.5;             // at 0.75 m
constexpr std::array kRangesCm{30, 75, 120};
constexpr int kPosesPerRange = 4;

/// The sensor is held by the tip of a stand, 15 mm from its middle.
std::vector<sim::Pose> on_marks(std::mt19937_64& random) {
    std::normal_distribution<double> hand(0, kHand_m);
    std::vector<sim::Pose> poses;
    for (int n = 0; n < kNodes * kAttitudes; ++n) {
        const int node = n / kAttitudes;
        const Quat<double> q = test::random_attitude(random);
        const Vec3<double> mark(0.4, kSpacing_m * (node % 6 - 2.5), kSpacing_m * (node / 6 - 1.5));
        const Vec3<double> slip(hand(random), hand(random), hand(random));
        poses.push_back({mark + slip + q.toRotationMatrix() * Vec3<double>(0, 0, 0.015), q});
    }
    return poses;
}

/// In the half space of x, not near its border.
sim::Pose anywhere(double range_m, std::mt19937_64& random) {
    sim::Pose pose = test::random_pose(range_m, random);
    pose.position_m = range_m * (pose.position_m / range_m + 0.4 * Vec3<double>::UnitX()).normalized();
    return pose;
}

/// As tricoil convert --to rests; without quadratures.
std::string write_rests(const std::string& name, const host::PoseFile& rests, std::size_t from, std::size_t to) {
    std::string text = "x11,x12,x13,x21,x22,x23,x31,x32,x33,a11,a12,a13,a21,a22,a23,a31,a32,a33,gain_step\n";
    for (std::size_t n = from; n < to; ++n) {
        const host::MeasuredPose& rest = rests.poses[n];
        for (Index k = 0; k < 9; ++k) {
            text += fmt::format("{:.9g},", rest.x(k / 3, k % 3));
        }
        for (Index k = 0; k < 9; ++k) {
            text += fmt::format("{:.9g},", rest.levels->share(k / 3, k % 3));
        }
        text += fmt::format("{}\n", rest.levels->gain_step);
    }
    return test::write_file(name, text);
}

/// The calibration and its blob. TRICOIL_PYTHON: the interpreter, with the package in its path.
host::CalibrationFile calibrated_by_hand(const host::PoseFile& rests) {
    constexpr std::size_t kOnGrid = kNodes * kAttitudes;
    const std::string grid = write_rests("grid.csv", rests, 0, kOnGrid);
    const std::string others = write_rests("rests.csv", rests, kOnGrid, rests.poses.size());
    const std::string posed = test::path_in_temp("posed.csv");
    const std::string cal = test::path_in_temp("cal.toml");
    const std::string program = fmt::format(
        "import tricoil; print(tricoil.hand_poses('{}', '{}', '{}', nodes=(6, 4, 1), spacing_mm=100))", grid, others, posed);
    const auto placed = test::run_program(TRICOIL_PYTHON, fmt::format("-c \"{}\"", program));
    EXPECT_EQ(placed.exit_code, 0) << placed.err;
    const auto fitted = test::run_program(
        TRICOIL_PROGRAM,
        fmt::format("calibrate converters --model concentric --out {} --blob {} {}", cal, test::path_in_temp("cal.bin"), posed));
    EXPECT_EQ(fitted.exit_code, 0) << fitted.err;
    return host::read_calibration(cal);
}

double squared_error_mm2(const host::CalibrationFile& calibrated, const sim::Pose& truth, const test::RestFrame& frame) {
    host::PoseFile file;
    file.path = "posed.csv";
    file.poses.push_back(test::at(truth, frame.x - calibrated.calibration.pick_up.in_phase));
    return 1e6 * evaluate(calibrated, {file}, host::EvaluationSolver::direct).front().error_m.squaredNorm();
}

/// Prints the row of BRING-UP.md. Errors of single frames, with noise, drift and errors of the converters.
TEST(ByHand, DrawnBoardsReachTheGoal) {
    std::map<int, double> squares;
    std::map<int, int> counts;
    for (std::uint64_t seed = 1; seed <= kBoards; ++seed) {
        std::mt19937_64 random(seed + 300);
        std::vector<sim::Pose> poses = on_marks(random);
        for (int n = 0; n < kAnywhere; ++n) {
            poses.push_back(anywhere(0.28 + 0.94 * n / (kAnywhere - 1), random));
        }
        const auto still = [] { return host::load_scenario("still", 1); };
        const host::PoseFile rests =
            test::means_of(test::measure(BoardCircuit::draw(seed), still(), kMode, poses, nullptr).frames, poses);
        const host::CalibrationFile calibrated = calibrated_by_hand(rests);
        const calibration::Blob blob = calibration::encode(calibrated.calibration);
        std::vector<sim::Pose> tests;
        for (const int cm : kRangesCm) {
            for (int n = 0; n < kPosesPerRange; ++n) {
                tests.push_back(anywhere(0.01 * cm, random));
            }
        }
        const auto measured = test::measure(BoardCircuit::draw(seed, kWarmerK), still(), kMode, tests, &blob).frames;
        for (std::size_t n = 0; n < tests.size(); ++n) {
            const int cm = kRangesCm[n / kPosesPerRange];
            for (const test::RestFrame& frame : measured[n]) {
                squares[cm] += squared_error_mm2(calibrated, tests[n], frame);
                ++counts[cm];
            }
        }
    }
    for (const auto& [cm, sum] : squares) {
        std::printf("by hand, %.2f m: %.2f mm\n", 0.01 * cm, std::sqrt(sum / counts[cm]));
    }
    const double at_goal_mm = std::sqrt(squares[75] / counts[75]);
    EXPECT_LT(at_goal_mm, kGoalMm);
    EXPECT_GT(at_goal_mm, 0.1) << "better than the noise";
}

}  // namespace
}  // namespace tricoil
