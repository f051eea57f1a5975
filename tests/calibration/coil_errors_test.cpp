// Errors that a calibration states of itself, against those of poses computed with it.
#include <gtest/gtest.h>

#include <fstream>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/judge/coil_errors.hpp"
#include "tests/support/random_poses.hpp"
#include "tests/support/squared_sigmas.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::host {
namespace {

constexpr double kStageConstant = 2.5e-3;
constexpr double kCouplingNoise = 3e-3;  // of each coupling, relative to k

std::array<double, kMagnetic> drawn_parameters(test::RandomPoses& random, double offset) {
    std::array<double, kMagnetic> p{};
    for (int k = 0; k < kOctupoles; ++k) {
        const double spread = k < kSourceOffsets ? 0.05 : offset;
        p[static_cast<std::size_t>(k)] = random.uniform(-spread, spread);
    }
    for (const int diagonal : {0, 1, 2, kSensitivities, kSensitivities + 1}) {
        p[static_cast<std::size_t>(diagonal)] += 1;
    }
    return p;
}

solver::RigidPose<double> random_pose(test::RandomPoses& random) {
    const Vec3<double> place(random.uniform(0.2, 0.4), random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15));
    return {place, random.attitude()};
}

Mat3<double> couplings_of(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose) {
    return field::signal_matrix<double>(model, pose.position_m, pose.q_source_sensor.toRotationMatrix().transpose());
}

Mat3<double> with_noise(const Mat3<double>& x, test::RandomPoses& random, double noise = kCouplingNoise) {
    return x + noise * x.norm() / std::sqrt(1.5) * random.gaussian_matrix();
}

/// Mean squared error of positions over their stated variance, per degree of freedom; sums over calibrations.
struct Nees {
    double sum = 0;
    double count = 0;
    double beyond_5 = 0;

    void add(const field::GeneralDipole<double>& truth, const field::GeneralDipole<double>& found,
             const calibration::CoilErrors<double>& errors, test::RandomPoses& random) {
        for (int k = 0; k < 20; ++k) {
            const auto pose = random_pose(random);
            const auto solved = solver::minimise<double>(found, couplings_of(truth, pose), Mat3<double>::Ones(), pose);
            const Vec3<double> error_m = solved.value().pose.position_m - pose.position_m;
            const Mat6<double> covariance = tracking::covariance_of_coil_errors(errors, pose.position_m);
            const double squares = test::squared_sigmas(error_m, covariance.topLeftCorner<3, 3>());
            sum += squares;
            count += 3;
            beyond_5 += squares > 25 ? 1 : 0;
        }
    }
    void expect(double least, double most, const char* name) const {
        std::printf("%s: NEES per degree of freedom %.2f, beyond 5 sigma %.2f %%\n", name, sum / count, 300 * beyond_5 / count);
        EXPECT_GT(sum / count, least) << name;
        EXPECT_LT(sum / count, most) << name;
        EXPECT_LT(beyond_5, 0.01 * count / 3) << name;
    }
};

CalibrationFile read_text_of(const std::string& text) {
    const std::string path = test::path_in_temp("errors.toml");
    std::ofstream(path) << text;
    return read_calibration(path);
}

TEST(CoilErrors, AreStoredAndImpossibleOnesRefused) {
    CalibrationFile file;
    file.model = "concentric";
    const std::string older = to_toml(file);
    EXPECT_EQ(older.find("[errors]"), std::string::npos);
    EXPECT_TRUE(read_text_of(older).calibration.errors.is_none());
    file.calibration.errors = {0.01, 2e-4, 0.75};
    const auto read = read_text_of(to_toml(file)).calibration.errors;
    EXPECT_EQ(read.coupling_constant, 0.01);
    EXPECT_EQ(read.couplings, 2e-4);
    EXPECT_EQ(read.floor_share, 0.75);
    const std::string by_hand = older + "\n[errors]\nversion = 1\n";
    EXPECT_EQ(read_text_of(by_hand + "coupling_constant = 0.01\n").calibration.errors.coupling_constant, 0.01);
    for (const char* wrong :
         {"", "coupling_constant = -0.01", "coupling_constant = 1e308", "coupling_constant = nan", "coupling_constant = \"1 %\"",
          "coupling_constant = 0.01\ncouplings = -1", "coupling_constant = 0.01\nfloor_share = 0",
          "coupling_constant = 0.01\ncoupling = 1e-3", "couplings = 1e-4"}) {
        EXPECT_THROW(read_text_of(by_hand + wrong + "\n"), InputError) << wrong;
    }
    EXPECT_THROW(read_text_of(older + "\n[errors]\nversion = 2\ncoupling_constant = 0.01\n"), InputError);
    EXPECT_THROW(read_text_of(older + "\n[errors]\ncoupling_constant = 0.01\n"), InputError);
}

TEST(CoilErrors, OfStageCalibrationsAreTrue) {
    for (const FitModel model : {FitModel::concentric, FitModel::general}) {
        Nees nees;
        for (std::uint64_t seed = 1; seed <= 20; ++seed) {
            test::RandomPoses random(seed);
            const auto truth = model_of(drawn_parameters(random, model == FitModel::general ? 0.05 : 0).data(), kStageConstant);
            PoseFile file;
            file.path = "simulated";
            for (int k = 0; k < 150; ++k) {
                const auto pose = random_pose(random);
                MeasuredPose measured;
                measured.x = with_noise(couplings_of(truth, pose), random);
                measured.stage_position_m = pose.position_m;
                measured.stage_rotation = pose.q_source_sensor.toRotationMatrix();
                file.poses.push_back(measured);
            }
            FitOptions options;
            options.model = model;
            const CalibrationFit fit = fit_calibration({file}, options);
            nees.add(truth, fit.model, fit.errors, random);
        }
        nees.expect(0.7, 1.4, model == FitModel::general ? "stage, general" : "stage, concentric");
    }
}

/// Their scale is not part of the result: here the coupling constant is known.
TEST(CoilErrors, OfFreeMotionAreNotTooSmall) {
    Nees triads;
    Nees coils;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        test::RandomPoses random(seed);
        std::vector<Mat3<double>> frames;
        auto p = drawn_parameters(random, 0);
        p[2] = 3 - p[0] - p[1];
        const auto truth = model_of(p.data(), kStageConstant);
        for (int k = 0; k < 120; ++k) {
            frames.push_back(with_noise(couplings_of(truth, random_pose(random)), random));
        }
        const SelfCalibration found = self_calibrate(frames);
        field::GeneralDipole<double> model;
        model.source_moment = kStageConstant * found.source;
        model.sensor_sensitivity = found.sensor;
        triads.add(truth, model, {0, found.coupling_error()}, random);
        const auto bundle = fit_free_motion(frames, FitModel::general, kStageConstant, Vec3<double>::UnitX());
        coils.add(truth, bundle.coils.model, bundle.coils.errors, random);
    }
    triads.expect(0.3, 1.4, "free motion, concentric");
    coils.expect(0, 1.4, "free motion, general");
}

TEST(CoilErrors, OfAGridContainThatOfItsScale) {
    Nees nees;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        test::RandomPoses random(seed);
        const auto truth = model_of(drawn_parameters(random, 0).data(), kStageConstant);
        std::vector<GridFrame> frames;
        for (int k = 0; k < 64; ++k) {
            GridFrame frame;
            frame.node = {double(k % 4), double(k / 4 % 4), 0};
            const solver::RigidPose<double> pose{
                Vec3<double>(0.25, -0.08, -0.08) + 0.05 * frame.node + 1e-3 * random.gaussian_vector(), random.attitude()};
            frame.x = with_noise(couplings_of(truth, pose), random, kCouplingNoise / 10);
            frames.push_back(frame);
        }
        const auto found = calibrate_on_grid(frames, 0.05, Vec3<double>::UnitX());
        nees.add(truth, found.coils.model, found.coils.errors, random);
        EXPECT_GT(found.coils.errors.coupling_constant, 1e-3);
    }
    nees.expect(0.3, 1.4, "grid");
}

}  // namespace
}  // namespace tricoil::host
