// Pick-up: couplings that do not come from the sensor. Found on a stage and with a dummy, removed by trackers, and flagged if no
// calibration removes it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/support/calibration_file.hpp"
#include "core/calibration/blob.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::host {
namespace {

using ::testing::HasSubstr;

constexpr double kConstant = 6.75e-3;                           // of the simulated coils
constexpr double kStrength = kConstant / (0.75 * 0.75 * 0.75);  // k at 0.75 m
constexpr double kShare = 4.2e-3;                               // 1 nH of common ground
constexpr double kNoise = 3e-5 * kStrength;                     // of the mean of a rest

/// Nine numbers of one size with random signs.
Mat3<double> drawn(std::uint64_t seed, double share = kShare) {
    test::RandomPoses random(1000 + seed);
    return random.gaussian_matrix().unaryExpr([=](double sign) { return std::copysign(share * kStrength, sign); });
}

PoseFile rests(std::size_t count, double nearest_m, double farthest_m, const Mat3<double>& pick_up, std::uint64_t seed) {
    test::RandomPoses random(seed);
    PoseFile file;
    file.path = "rests";
    for (std::size_t n = 0; n < count; ++n) {
        const double range_m = nearest_m + (farthest_m - nearest_m) * static_cast<double>(n) / static_cast<double>(count);
        Vec3<double> direction = random.direction();
        direction.x() = 0.3 + std::abs(direction.x());
        const Vec3<double> place = range_m * direction.normalized();
        const Quat<double> q = random.attitude();
        const Mat3<double> x = kConstant * test::unit_signal(place, q) + pick_up + kNoise * random.gaussian_matrix();
        file.poses.push_back({{x}, place, q.toRotationMatrix(), n + 1});
    }
    return file;
}

CalibrationFit fitted(const PoseFile& file, bool finds_pick_up, FitModel model = FitModel::concentric) {
    FitOptions options;
    options.model = model;
    options.finds_pick_up = finds_pick_up;
    return fit_calibration({file}, options);
}

/// 3D RMS of poses at a range that were not fitted, without the pick-up of the fit; mm.
double error_mm(const CalibrationFit& fit, double range_m, const Mat3<double>& pick_up) {
    CalibrationFile calibration;
    calibration.calibration.model = fit.model;
    calibration.source_stage = fit.source_stage;
    calibration.mount_sensor = fit.mount_sensor;
    PoseFile file = rests(60, range_m, range_m, pick_up - fit.pick_up, 77);
    double squares = 0;
    for (const EvaluatedPose& pose : evaluate(calibration, {file}, EvaluationSolver::direct)) {
        squares += 1e6 * pose.error_m.squaredNorm() / 60;
    }
    return std::sqrt(squares);
}

TEST(PickUp, IsFoundOnAStage) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const Mat3<double> pick_up = drawn(seed);
        const PoseFile data = rests(72, 0.25, 0.85, pick_up, seed);
        const CalibrationFit without = fitted(data, false);
        const CalibrationFit with = fitted(data, true);
        const double wrong_mm = error_mm(without, 0.75, pick_up);
        const double right_mm = error_mm(with, 0.75, pick_up);
        std::printf("0.42 %% of k(0.75 m): at 0.75 m %.2f mm, calibrated %.3f mm\n", wrong_mm, right_mm);
        EXPECT_GT(wrong_mm, 2);
        EXPECT_LT(right_mm, 0.25);
        EXPECT_LT((with.pick_up - pick_up).norm() / 3, 3 * with.pick_up_sigma);
        EXPECT_LT(with.pick_up_sigma, 1e-4 * kStrength);
    }
}

TEST(PickUp, ACalibrationWithoutPickUpIsNotChanged) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const PoseFile data = rests(72, 0.25, 0.85, Mat3<double>::Zero(), seed);
        for (const FitModel model : {FitModel::concentric, FitModel::finite}) {
            const CalibrationFit without = fitted(data, false, model);
            const CalibrationFit with = fitted(data, true, model);
            EXPECT_TRUE(with.pick_up.isZero(0));
            EXPECT_EQ(with.model.source_moment, without.model.source_moment);
            EXPECT_EQ(with.residual_rms, without.residual_rms);
        }
    }
}

/// Programs with a simulated sensor.
class Command : public ::testing::Test {
protected:
    static std::string scenario(const char* name, double range_m, const Mat3<double>& pick_up) {
        return test::write_file(
            name, fmt::format("duration_s = 3\n[motion]\nkind = \"still\"\nposition_m = [{}, {}, {}]\n"
                              "euler_deg = [20, -10, 35]\n[world]\npick_up = [[{}, {}, {}], [{}, {}, {}], "
                              "[{}, {}, {}]]\n",
                              0.8 * range_m, 0.48 * range_m, -0.36 * range_m, pick_up(0, 0), pick_up(0, 1), pick_up(0, 2),
                              pick_up(1, 0), pick_up(1, 1), pick_up(1, 2), pick_up(2, 0), pick_up(2, 1), pick_up(2, 2)));
    }
    static std::string record(double range_m, const Mat3<double>& pick_up, const std::string& mode = "tdm") {
        std::filesystem::remove_all(test::path_in_temp("take"));
        const auto ran = test::tricoil("run --mux " + mode + " --scenario " + scenario("far.toml", range_m, pick_up) +
                                       " --record " + test::path_in_temp("take"));
        EXPECT_EQ(ran.exit_code, 0) << ran.err;
        return test::path_in_temp("take");
    }
    /// Ideal coils, with a floor as of a good calibration.
    static std::string coils() {
        CalibrationFile file;
        file.model = "concentric";
        file.calibration.model.source_moment *= kConstant;
        file.calibration.misfit_floor = 3e-4;
        return test::write_file("coils.toml", to_toml(file));
    }
    static test::CliResult calibrate(const std::string& take, const std::string& more = "") {
        return test::tricoil("calibrate pick-up --json --calibration " + coils() + " --out " + kOut + " " + take + more);
    }
    static test::CliResult simulate(const std::string& calibration, const Mat3<double>& pick_up) {
        return test::tricoil("run --json --tracker direct --calibration " + calibration + " --scenario " +
                             scenario("near.toml", 0.75, pick_up));
    }
    static nlohmann::json run(const std::string& calibration, const Mat3<double>& pick_up) {
        const auto ran = simulate(calibration, pick_up);
        EXPECT_EQ(ran.exit_code, 0) << ran.err;
        return ran.json();
    }
    static void refused(const test::CliResult& ran, const std::string& reason) {
        EXPECT_EQ(ran.exit_code, 2);
        EXPECT_THAT(ran.err, HasSubstr(reason));
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    }
    static inline const std::string kOut = test::path_in_temp("quiet.toml");
};

TEST_F(Command, IsMeasuredWithADummyAndRemoved) {
    const Mat3<double> pick_up = drawn(3);
    const auto ran = calibrate(record(60, pick_up), " --blob " + test::path_in_temp("quiet.bin"));
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    const auto found = read_calibration(kOut).calibration.pick_up;
    EXPECT_LT((found.in_phase - pick_up).norm(), 9 * found.sigma);
    EXPECT_LT(found.quadrature.norm(), 9 * found.sigma);
    EXPECT_LT(found.sigma, 1e-3 * kStrength);
    EXPECT_EQ(test::read_file(test::path_in_temp("quiet.bin")).size(), calibration::kPickUpBlobBytes);
    const auto right = run(kOut, pick_up);
    EXPECT_EQ(right["poses_distorted"], 0);
    const auto clean = run(coils(), Mat3<double>::Zero());
    EXPECT_EQ(clean["poses_distorted"], 0);
    std::printf("at 0.75 m: %.3f mm, with calibrated pick-up %.3f mm\n", 1e3 * clean["position_rms_m"].get<double>(),
                1e3 * right["position_rms_m"].get<double>());
}

/// The wiring changed after the calibration: the poses are distorted, and some of them even invalid.
TEST_F(Command, IsFlaggedIfNoCalibrationRemovesIt) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        const auto ran = simulate(coils(), drawn(seed));
        const auto wrong = ran.json();
        const double valid = wrong["poses_scored"];
        std::printf("seed %d: %.0f valid poses, %.0f of them distorted; %s\n", int(seed), valid,
                    wrong["poses_distorted"].get<double>(), wrong["flags_seen"].get<std::string>().c_str());
        EXPECT_THAT(wrong["flags_seen"].get<std::string>(), HasSubstr("distorted"));
        EXPECT_GE(wrong["poses_distorted"].get<double>(), 0.95 * valid) << seed;
        EXPECT_EQ(ran.exit_code, valid > 0 ? 0 : 1) << ran.err;
    }
}

TEST_F(Command, TheLowBandHasItsOwn) {
    const auto ran = calibrate(record(60, drawn(3, 0.05), "dual-band"));
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    const auto found = read_calibration(kOut).calibration.low_band.pick_up;
    EXPECT_LT((found.in_phase - drawn(3, 0.05)).norm(), 9 * found.sigma);
    EXPECT_GT(found.in_phase.norm(), 9 * found.sigma);
}

/// Free motion and grids do not find the pick-up.
TEST_F(Command, IsTakenFromAnotherCalibration) {
    std::string text = std::string(kPoseCsvHeader) + "\n";
    for (const MeasuredPose& pose : rests(72, 0.25, 0.85, drawn(2), 2).poses) {
        text += fmt::format("{},{},{},1,0,0,0,{}\n", pose.stage_position_m(0), pose.stage_position_m(1), pose.stage_position_m(2),
                            matrix_text(pose.x));
    }
    const std::string data = test::write_file("rests.csv", text);
    CalibrationFile known = read_calibration(coils());
    known.calibration.pick_up = {drawn(2), Mat3<double>::Zero(), 1e-7};
    known.calibration.low_band.pick_up = {drawn(5), Mat3<double>::Zero(), 1e-7};
    const std::string from = test::write_file("known.toml", to_toml(known));
    const auto misfit = [&](const std::string& more) {
        const auto ran = test::tricoil("calibrate free-motion --json --out " + kOut + " " + data + more);
        EXPECT_EQ(ran.exit_code, 0) << ran.err;
        return ran.json()["misfit_after"].get<double>();
    };
    const double without = misfit("");
    EXPECT_GT(without, 10 * misfit(" --converters-from " + from));
    EXPECT_EQ(read_calibration(kOut).calibration.pick_up.in_phase, drawn(2));
    EXPECT_EQ(read_calibration(kOut).calibration.low_band.pick_up.in_phase, drawn(5));
    refused(test::tricoil("calibrate free-motion --out " + kOut + " " + data + " --converters-from " + coils()),
            "does not contain errors of converters or pick-up");
}

TEST_F(Command, BadInputIsRefused) {
    std::filesystem::remove(kOut);
    refused(calibrate(record(0.6, drawn(3))), "the couplings are those of a sensor at 0.6");
    refused(calibrate(record(2, Mat3<double>::Zero()), " --distance-m 2"),
            "a sensor at 2 m has couplings as large as the pick-up");
    refused(calibrate("/nowhere"), "/nowhere");
    refused(calibrate(test::path_in_temp("take"), " --distance-m -1"), "--distance-m");
    EXPECT_FALSE(std::filesystem::exists(kOut));
    const auto with = [](const std::string& lines) {
        std::string text = test::read_file(coils());
        text.insert(text.find("phase_rad"), lines);
        return test::tricoil("run --calibration " + test::write_file("bad.toml", text));
    };
    const std::string zeros = "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]\n";
    refused(with("pick_up = [[5, 0, 0], [0, 0, 0], [0, 0, 0]]\npick_up_quadrature = " + zeros + "pick_up_sigma = 0\n"),
            "the pick-up must be smaller than the couplings at 0.2 m");
    refused(with("pick_up = " + zeros), "'couplings.pick_up_quadrature' is missing");
    refused(with("pick_up_quadrature = " + zeros), "'couplings.pick_up' is missing");
    refused(with("pick_up = " + zeros + "pick_up_quadrature = " + zeros + "pick_up_sigma = -1\n"), "is negative");
    const std::string part = test::read_file(coils()) + "\n[surroundings_quadrature]\nversion = 1\n";
    refused(test::tricoil("run --calibration " + test::write_file("bad.toml", part)),
            "'surroundings_quadrature.deviation' is missing");
}

TEST_F(Command, ChangingCouplingsAreRefused) {
    const std::string take = test::path_in_temp("take");
    for (const std::string scenario : {"hand --duration 6", "dummy --duration 6 --fault unplugged@2-4"}) {
        std::filesystem::remove_all(take);
        ASSERT_EQ(test::tricoil("run --scenario " + scenario + " --record " + take).exit_code, 0);
        refused(calibrate(take), "the couplings change by");
    }
}

TEST_F(Command, TheOlderLowBandIsKept) {
    CalibrationFile known = read_calibration(coils());
    known.calibration.low_band.pick_up = {drawn(5), Mat3<double>::Zero(), 1e-7};
    const std::string from = test::write_file("known.toml", to_toml(known));
    const auto ran = test::tricoil("calibrate pick-up --calibration " + from + " --out - " + record(60, drawn(3)));
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.out + ran.err, HasSubstr("has no low band; the older low-band pick-up is kept"));
    EXPECT_THAT(ran.out + ran.err, HasSubstr("--converters-from this one"));
}

/// The pick-up is removed before the wiring is known.
TEST_F(Command, OtherWiringIsRefused) {
    const auto data = [](const char* name, double sign, bool transposed = false) {
        std::string text = std::string(kPoseCsvHeader) + "\n";
        for (const MeasuredPose& pose : rests(72, 0.25, 0.85, drawn(2), 2).poses) {
            const Quat<double> q(pose.stage_rotation);
            Mat3<double> x = pose.x;
            x.row(1) *= sign;
            text += fmt::format("{},{},{},{},{},{},{},{}\n", pose.stage_position_m(0), pose.stage_position_m(1),
                                pose.stage_position_m(2), q.w(), q.x(), q.y(), q.z(),
                                matrix_text(transposed ? Mat3<double>(x.transpose()) : x));
        }
        return test::write_file(name, text);
    };
    const std::string straight = data("soYoutZup_seYoutZup_straight.csv", 1);
    const std::string reversed = data("soYoutZup_seYoutZup_reversed.csv", -1);
    const auto ran = test::tricoil("calibrate stage --model concentric --out " + kOut + " " + straight);
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    ASSERT_FALSE(read_calibration(kOut).calibration.pick_up.is_none());
    refused(test::tricoil("evaluate --calibration " + kOut + " " + reversed), "pick-up needs the wiring of the calibration");
    const std::string transposed = data("soYoutZup_seYoutZup_transposed.csv", 1, true);
    refused(test::tricoil("calibrate stage --converters-from " + kOut + " --out " + test::path_in_temp("new.toml") + " " +
                          transposed),
            "need the wiring with which they were measured");
}

}  // namespace
}  // namespace tricoil::host
