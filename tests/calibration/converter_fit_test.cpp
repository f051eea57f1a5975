// Errors of converters and gain steps, found from couplings at known poses. The converters are those of the virtual board: codes
// with drawn capacitors, which know nothing of jumps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string_view>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/support/errors.hpp"
#include "core/calibration/blob.hpp"
#include "sim/virtual_board/coils/converter_error.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::host {
namespace {

using ::testing::HasSubstr;

constexpr double kFullScale = 2048;  // codes
constexpr double kNoise = 0.012;     // codes: of the mean of a rest
constexpr std::string_view kLevelColumns = ",a11,a12,a13,a21,a22,a23,a31,a32,a33,gain_step";

/// Amplitude of a sine's fundamental, as a converter gives it; codes.
double converted(const virtual_board::ConverterError& converter, double amplitude) {
    constexpr int kPoints = 720;
    double sum = 0;
    for (int k = 0; k < kPoints; ++k) {
        const double sine = std::sin(2 * std::numbers::pi * (k + 0.5) / kPoints);
        sum += converter.code(kFullScale + amplitude * sine) * sine;
    }
    return 2 * sum / kPoints;
}

/// Measures couplings with three drawn converters, and gain steps of 2 that are wrong by 0.77 per mille RMS.
class DrawnBoard {
public:
    explicit DrawnBoard(std::uint64_t seed) : random_(seed) {
        std::normal_distribution<double> gain(0, 0.77e-3);
        for (auto& converter : converters_) {
            converter = virtual_board::ConverterError(random_);
        }
        for (auto& step : gain_error_) {
            step = {gain(random_), gain(random_), gain(random_)};
        }
    }

    /// An ideal board.
    DrawnBoard() = default;

    MeasuredPose measure(const Vec3<double>& position_m, const Quat<double>& q_source_sensor, std::size_t line) {
        MeasuredPose measured{{Mat3<double>::Zero()}, position_m, q_source_sensor.toRotationMatrix(), line};
        const Mat3<double> x = test::unit_signal(position_m, q_source_sensor);
        const int step = 9 + static_cast<int>(std::floor(std::log2(kLargestCodes / kCodes / x.cwiseAbs().maxCoeff())));
        const double codes = kCodes * std::ldexp(1.0, step - 9);
        std::normal_distribution<double> noise(0, kNoise);
        SignalLevels levels{Mat3<double>::Zero(), step};
        for (Index k = 0; k < 9; ++k) {
            const auto i = static_cast<std::size_t>(k / 3);
            const double amplitude = codes * std::abs(x(k / 3, k % 3)) * (1 + gain_error_.at(static_cast<std::size_t>(step))[i]);
            const double seen = converted(converters_[i], amplitude) + noise(random_);
            levels.share(k / 3, k % 3) = seen / kFullScale;
            measured.x(k / 3, k % 3) = std::copysign(seen / codes, x(k / 3, k % 3));
        }
        measured.levels = levels;
        return measured;
    }

private:
    static constexpr double kLargestCodes = 1500;
    static constexpr double kCodes = 400;  // for a coupling of 1 at step 9

    std::mt19937_64 random_{1};
    std::array<virtual_board::ConverterError, kSensorCoils> converters_{};
    std::array<std::array<double, kSensorCoils>, signal::kMaxGainSteps> gain_error_{};
};

/// `count` poses, from `nearest_m` on.
PoseFile poses_of(DrawnBoard& board, std::size_t count, double nearest_m, double farthest_m, std::uint64_t seed) {
    test::RandomPoses random(seed);
    PoseFile file;
    file.path = "rests";
    for (std::size_t n = 0; n < count; ++n) {
        const double range_m = nearest_m + (farthest_m - nearest_m) * static_cast<double>(n) / static_cast<double>(count);
        Vec3<double> direction = random.direction();
        direction.x() = 0.2 + std::abs(direction.x());  // away from the plane between the hemispheres
        file.poses.push_back(board.measure(range_m * direction.normalized(), random.attitude(), n + 1));
    }
    return file;
}

FitOptions concentric() {
    FitOptions options;
    options.model = FitModel::concentric;
    return options;
}

/// 3D RMS error of poses that were not fitted, mm.
double error_mm(const CalibrationFit& fit, const PoseFile& file) {
    CalibrationFile calibration;
    calibration.calibration.model = fit.model;
    calibration.model = "concentric";
    calibration.source_stage = fit.source_stage;
    calibration.mount_sensor = fit.mount_sensor;
    double squares = 0;
    for (const EvaluatedPose& pose : evaluate(calibration, {file}, EvaluationSolver::direct)) {
        squares += 1e6 * pose.error_m.squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(file.poses.size()));
}

PoseFile corrected(const PoseFile& file, const signal::ConverterErrors& errors) {
    std::vector<PoseFile> files{file};
    correct_converters(files, errors);
    return files[0];
}

/// As recorded with a board that corrects its converters.
PoseFile corrected_by_board(const PoseFile& file, const signal::ConverterErrors& errors) {
    PoseFile result = corrected(file, errors);
    for (MeasuredPose& pose : result.poses) {
        pose.levels = SignalLevels{Mat3<double>::Zero(), 0};
    }
    return result;
}

TEST(ConverterFit, RemovesTheErrorsOfDrawnConvertersAtOtherPoses) {
    double before = 0;
    double after = 0;
    constexpr int kBoards = 4;
    for (std::uint64_t seed = 1; seed <= kBoards; ++seed) {
        DrawnBoard board(seed);
        std::vector<PoseFile> files{poses_of(board, 36, 0.48, 0.84, seed)};
        const PoseFile others = poses_of(board, 60, 0.7, 0.8, 100 + seed);
        const CalibrationFit coils = fit_calibration(files, concentric());
        const ConverterFit fit = fit_converters(files, concentric());
        EXPECT_GT(fit.non_linearity_lsb, 0.1) << seed;
        EXPECT_GT(fit.gain_error, 1e-4) << seed;
        before += std::pow(error_mm(coils, others), 2) / kBoards;
        after += std::pow(error_mm(fit.coils, corrected(others, fit.errors)), 2) / kBoards;
    }
    std::printf("poses that were not fitted, 0.7 to 0.8 m: %.3f mm RMS, with corrected converters %.3f mm\n", std::sqrt(before),
                std::sqrt(after));
    EXPECT_GT(std::sqrt(before), 0.5);
    EXPECT_LT(std::sqrt(after), 0.12);
}

/// Coils on other channels, as a wiring file says, are a turned sensor with the same converters.
TEST(ConverterFit, ErrorsAreThoseOfTheChannels) {
    DrawnBoard board(7);
    std::vector<PoseFile> channels{poses_of(board, 100, 0.2, 0.8, 70)};
    std::vector<PoseFile> coils = channels;
    const ChannelWiring wiring{{{1, 2, 0}, {1, 1, 1}}, {}};
    for (MeasuredPose& pose : coils[0].poses) {
        pose.rewire(wiring);
    }
    signal::ConverterErrors first;
    first.gain.fill({127, 0, 0});
    std::vector<PoseFile> twice{corrected(channels[0], first), corrected(coils[0], first)};
    for (std::size_t n = 0; n < channels[0].poses.size(); ++n) {
        twice[0].poses[n].rewire(wiring);
        ASSERT_LT((twice[0].poses[n].x - twice[1].poses[n].x).norm(), 1e-12);
    }
    const auto straight = fit_converters(channels, concentric());
    const auto wired = fit_converters(coils, concentric());
    EXPECT_NEAR(wired.gain_error, straight.gain_error, 1e-6);
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        for (std::size_t step = 0; step < signal::kMaxGainSteps; ++step) {
            EXPECT_NEAR(wired.errors.gain[step][coil], straight.errors.gain[step][coil], 1);
        }
        for (std::size_t n = 0; n < signal::ConverterErrors::kJumps; ++n) {
            EXPECT_NEAR(wired.errors.jump[coil][n], straight.errors.jump[coil][n], 1);
        }
    }
}

TEST(ConverterFit, AnIdealBoardIsNotMadeWorse) {
    DrawnBoard board;
    std::vector<PoseFile> files{poses_of(board, 36, 0.48, 0.84, 5)};
    const PoseFile others = poses_of(board, 60, 0.7, 0.8, 6);
    const CalibrationFit coils = fit_calibration(files, concentric());
    const ConverterFit fit = fit_converters(files, concentric());
    EXPECT_LT(fit.non_linearity_lsb, 0.03);
    EXPECT_LT(error_mm(fit.coils, corrected(others, fit.errors)), 1.3 * error_mm(coils, others));
}

/// An outlier of the coils says nothing about the converters.
TEST(ConverterFit, IgnoresAnOutlier) {
    DrawnBoard board(2);
    std::vector<PoseFile> files{poses_of(board, 40, 0.48, 0.84, 2)};
    const PoseFile others = poses_of(board, 60, 0.7, 0.8, 102);
    files[0].poses[9].stage_position_m.x() += 0.02;
    const ConverterFit fit = fit_converters(files, concentric());
    EXPECT_THAT(fit.coils.outliers, ::testing::ElementsAre("rests:10"));
    EXPECT_LT(error_mm(fit.coils, corrected(others, fit.errors)), 0.15);
}

#ifdef TRICOIL_WITH_PYTHON
/// `tricoil calibrate converters` with a file of rests.
class Command : public ::testing::Test {
protected:
    static void write(const std::string& columns, const std::string& end_of_last_line = "") {
        DrawnBoard board(1);
        write(poses_of(board, 36, 0.48, 0.84, 1), columns, end_of_last_line);
    }
    static void write(const PoseFile& rests, const std::string& columns, const std::string& end_of_last_line = "") {
        std::string text = std::string(kPoseCsvHeader) + columns + "\n";
        for (const MeasuredPose& pose : rests.poses) {
            const Quat<double> q(pose.stage_rotation);
            text += fmt::format("{},{},{},{}\n", fmt::join(pose.stage_position_m, ","), q.w(),
                                fmt::join(Vec3<double>(q.vec()), ","), couplings_text(pose, columns));
        }
        if (!end_of_last_line.empty()) {
            text.replace(text.rfind(','), std::string::npos, end_of_last_line + "\n");
        }
        std::ofstream(kRests) << text;
    }
    static std::string couplings_text(const MeasuredPose& pose, const std::string& columns) {
        std::string text = matrix_text(pose.x);
        if (columns.find("q11") != std::string::npos) {
            text += "," + matrix_text(Mat3<double>::Zero());
        }
        if (columns.find("a11") != std::string::npos) {
            text += "," + matrix_text(pose.levels->share) + fmt::format(",{}", pose.levels->gain_step);
        }
        return text;
    }
    static test::CliResult calibrate(const std::string& more = "") {
        return test::tricoil("calibrate converters --model concentric --json --out " + kToml + " --blob " + kBlob + " " + kRests +
                             more);
    }
    /// Calibrates the coils alone.
    static test::CliResult calibrate_coils(const std::string& more) {
        return test::tricoil("calibrate stage --model concentric --json --out " + kCoils + " --blob " + kBlob + " " + kRests +
                             more);
    }
    /// 3D RMS error of the positions with the coils of a file.
    static double error_m(const std::string& path) {
        const CalibrationFile calibration = read_calibration(path);
        std::vector<PoseFile> files = read_pose_files({kRests});
        (void)correct_board(files, calibration.calibration);
        double squares = 0;
        for (const EvaluatedPose& pose : evaluate(calibration, files, EvaluationSolver::direct)) {
            squares += pose.error_m.squaredNorm();
        }
        return std::sqrt(squares / static_cast<double>(files[0].poses.size()));
    }
    static void refused(const test::CliResult& ran, const std::string& reason) {
        EXPECT_EQ(ran.exit_code, 2);
        EXPECT_THAT(ran.err, HasSubstr(reason));
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    }
    void TearDown() override {
        for (const std::string& path : {kRests, kToml, kCoils, kBlob}) {
            std::filesystem::remove(path);
        }
    }

    static inline const std::string kRests = test::path_in_temp("rests.csv");
    static inline const std::string kToml = test::path_in_temp("converters.toml");
    static inline const std::string kCoils = test::path_in_temp("coils.toml");
    static inline const std::string kBlob = test::path_in_temp("converters.bin");
    static inline const std::string kAll = std::string(kQuadratureColumns) + std::string(kLevelColumns);
};

TEST_F(Command, FileAndBlobHaveTheSameErrors) {
    write(kAll);
    const auto ran = calibrate();
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_GT(ran.json()["converters"]["non_linearity_lsb"], 0.1);
    const CalibrationFile file = read_calibration(kToml);
    EXPECT_NE(file.calibration.converters, signal::ConverterErrors{});
    const std::string bytes = test::read_file(kBlob);
    const auto decoded = calibration::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    ASSERT_TRUE(decoded.ok()) << decoded.status().message();
    EXPECT_EQ(decoded->converters, file.calibration.converters);
}

TEST_F(Command, RefusesBadLevels) {
    write("");
    refused(calibrate(), "rests.csv:2: the levels at the converters (a11 to a33) are not known");
    write(std::string(kLevelColumns));
    EXPECT_EQ(calibrate().exit_code, 0);
    write(kAll, ",12");
    refused(calibrate(), "rests.csv:37: gain_step: 12 is not a whole number from 0 to 11");
    write(kAll, ",2.5");
    refused(calibrate(), "rests.csv:37: gain_step: 2.5 is not a whole number from 0 to 11");
    write(kAll, "e9,3");
    refused(calibrate(), "rests.csv:37: a level (a11 to a33) is not a share of full scale, 0 to 1");
    write(kAll);
    refused(calibrate(" --spacing-mm 50"), "--spacing-mm is an option of tricoil calibrate grid, ");
}

/// A gain step of one channel is wrong by 2 %.
TEST_F(Command, RefusesErrorsOfUnsoundConverters) {
    DrawnBoard board(1);
    PoseFile rests = poses_of(board, 36, 0.48, 0.84, 1);
    const int farthest_step = rests.poses.back().levels->gain_step;
    for (MeasuredPose& pose : rests.poses) {
        pose.x.row(1) *= pose.levels->gain_step == farthest_step ? 1.02 : 1;
    }
    write(rests, kAll);
    refused(calibrate(), "the errors of the converters are larger than those of sound converters");
}

TEST_F(Command, RefusesALargeJump) {
    DrawnBoard board;
    PoseFile rests = poses_of(board, 48, 0.48, 0.84, 1);
    constexpr double kJump = 6.0 / kFullScale;
    for (MeasuredPose& pose : rests.poses) {
        for (Index j = 0; j < 3; ++j) {
            const double share = pose.levels->share(0, j);
            pose.x(0, j) *= 1 + kJump * double{signal::ConverterErrors::response(8, static_cast<float>(share))} / share;
        }
    }
    write(rests, kAll);
    refused(calibrate(), "the errors of the converters are larger than those of sound converters");
}

TEST_F(Command, RefusesTooFewCouplingsThatAreNotFaint) {
    DrawnBoard board(1);
    PoseFile rests = poses_of(board, 36, 0.48, 0.84, 1);
    for (MeasuredPose& pose : rests.poses) {
        pose.levels->share *= 0.01;
    }
    write(rests, kAll);
    refused(calibrate(), "do not determine the errors of the converters; measure more poses");
}

/// With known levels the couplings are corrected, with unknown levels the board has corrected them.
TEST_F(Command, ConvertersFromAnotherCalibrationAreKept) {
    DrawnBoard board(1);
    write(poses_of(board, 48, 0.48, 0.84, 1), kAll);
    ASSERT_EQ(calibrate().exit_code, 0);
    const CalibrationFile first = read_calibration(kToml);
    PoseFile others = poses_of(board, 60, 0.6, 0.8, 101);
    write(others, kAll);
    ASSERT_EQ(calibrate_coils("").exit_code, 0);
    const double uncorrected_m = error_m(kCoils);
    const auto ran = calibrate_coils(" --converters-from " + kToml);
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_EQ(read_calibration(kCoils).calibration.converters, first.calibration.converters);
    EXPECT_LT(error_m(kCoils), 0.4 * uncorrected_m);

    others = corrected_by_board(others, first.calibration.converters);
    write(others, kAll);
    const auto again = calibrate_coils(" --converters-from " + kToml);
    ASSERT_EQ(again.exit_code, 0) << again.err;
    EXPECT_EQ(again.json()["warnings"].dump().find("does not contain"), std::string::npos);
    EXPECT_LT(error_m(kCoils), 0.4 * uncorrected_m);
    EXPECT_EQ(read_calibration(kCoils).calibration.converters, first.calibration.converters);

    others.poses[3].levels = SignalLevels{Mat3<double>::Constant(0.1), 3};
    write(others, kAll);
    refused(calibrate_coils(" --converters-from " + kToml), "59 of 60 couplings have no levels");
}

/// In a printed grid of 50 mm, three attitudes at each node.
TEST_F(Command, GridIsCorrectedToo) {
    DrawnBoard board(1);
    write(poses_of(board, 48, 0.48, 0.84, 1), kAll);
    ASSERT_EQ(calibrate().exit_code, 0);
    test::RandomPoses random(7);
    PoseFile others;
    std::vector<std::string> nodes;
    for (int n = 0; n < 75; ++n) {
        const Vec3<double> node(n % 5, n / 5 % 5, 0);
        others.poses.push_back(board.measure(Vec3<double>(0.5, -0.1, -0.1) + 0.05 * node, random.attitude(), 1));
        nodes.push_back(fmt::format("{}", fmt::join(node, ",")));
    }
    const auto on_grid = [&](const PoseFile& file, const std::string& more) {
        std::string text = "column,row,level,x11,x12,x13,x21,x22,x23,x31,x32,x33" + std::string(kLevelColumns) + "\n";
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            text += nodes[n] + "," + couplings_text(file.poses[n], std::string(kLevelColumns)) + "\n";
        }
        std::ofstream(kRests) << text;
        const auto ran = test::tricoil("calibrate grid --spacing-mm 50 --json --out " + kCoils + " " + kRests + more);
        EXPECT_EQ(ran.exit_code, 0) << ran.err;
        return read_calibration(kCoils).calibration.model.sensor_sensitivity;
    };
    const std::string stored = " --converters-from " + kToml;
    const Mat3<double> uncorrected = on_grid(others, "");
    const Mat3<double> by_host = on_grid(others, stored);
    const Mat3<double> by_board = on_grid(corrected_by_board(others, read_calibration(kToml).calibration.converters), stored);
    EXPECT_LT((by_host - by_board).norm(), 1e-6);
    EXPECT_GT((by_host - uncorrected).norm(), 1e-5);
}

TEST_F(Command, FreeMotionIsCorrectedToo) {
    DrawnBoard board(1);
    write(poses_of(board, 48, 0.48, 0.84, 1), kAll);
    ASSERT_EQ(calibrate().exit_code, 0);
    const auto free_motion = [](const std::string& more) {
        const auto ran = test::tricoil("calibrate free-motion --json --out " + kCoils + " " + kRests + more);
        EXPECT_EQ(ran.exit_code, 0) << ran.err;
        return read_calibration(kCoils).calibration.model.sensor_sensitivity;
    };
    const PoseFile others = poses_of(board, 60, 0.6, 0.8, 101);
    write(others, kAll);
    const Mat3<double> uncorrected = free_motion("");
    const Mat3<double> by_host = free_motion(" --converters-from " + kToml);
    write(corrected_by_board(others, read_calibration(kToml).calibration.converters), kAll);
    const Mat3<double> by_board = free_motion(" --converters-from " + kToml);
    EXPECT_LT((by_host - by_board).norm(), 1e-6);
    EXPECT_GT((by_host - uncorrected).norm(), 1e-5);
}

/// Each file is of one kind, but not all of the same.
TEST_F(Command, RefusesFilesWithAndWithoutLevels) {
    DrawnBoard board(1);
    write(poses_of(board, 48, 0.48, 0.84, 1), kAll);
    ASSERT_EQ(calibrate().exit_code, 0);
    const PoseFile others = poses_of(board, 60, 0.6, 0.8, 101);
    const std::string corrected_rests = test::path_in_temp("corrected_rests.csv");
    write(corrected_by_board(others, read_calibration(kToml).calibration.converters), kAll);
    std::filesystem::rename(kRests, corrected_rests);
    write(others, kAll);
    const std::string both = " " + corrected_rests + " --converters-from " + kToml;
    refused(calibrate_coils(both), "60 of 120 couplings have no levels");
    refused(test::tricoil("calibrate free-motion --out " + kCoils + " " + kRests + both), "60 of 120 couplings have no levels");
}

TEST_F(Command, WarnsIfTheBoardWouldForgetItsConverters) {
    DrawnBoard board(1);
    PoseFile rests = poses_of(board, 36, 0.48, 0.84, 1);
    for (MeasuredPose& pose : rests.poses) {
        pose.levels = SignalLevels{Mat3<double>::Zero(), 0};
    }
    write(rests, kAll);
    const auto ran = calibrate_coils("");
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.json()["warnings"].dump(), HasSubstr("does not contain errors of converters; a board"));
    refused(calibrate_coils(" --converters-from " + kCoils), "choose");
    std::filesystem::rename(kCoils, kToml);
    refused(calibrate_coils(" --converters-from " + kToml), "does not contain errors of converters");
}

TEST_F(Command, RefusesDamagedErrorsInTheCalibration) {
    write(kAll);
    ASSERT_EQ(calibrate().exit_code, 0);
    std::string text = test::read_file(kToml);
    text.replace(text.find("code_jumps_2 = ["), 16, "code_jumps_2 = [1, ");
    std::ofstream(kToml) << text;
    const std::string run = "run --calibration " + kToml;
    refused(test::tricoil(run), "'converters.code_jumps_2' must be 14 whole numbers from -127 to 127");
    text.replace(text.find("code_jumps_2 = ["), 12, "code_jumpz_2");
    std::ofstream(kToml) << text;
    refused(test::tricoil(run), "'converters.code_jumps_2' is missing; 'converters.code_jumpz_2' is not a known key");
}

#endif

TEST(ConverterFit, RefusesUnknownLevelsAndFewPoses) {
    DrawnBoard board(1);
    std::vector<PoseFile> files{poses_of(board, 36, 0.48, 0.84, 1)};
    files[0].poses[7].levels.reset();
    try {
        (void)fit_converters(files, concentric());
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("rests:8: the levels at the converters"));
    }
    files = {poses_of(board, kFewestConverterPoses - 1, 0.48, 0.84, 1)};
    try {
        (void)fit_converters(files, concentric());
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("35 poses do not determine"));
    }
}

}  // namespace
}  // namespace tricoil::host
