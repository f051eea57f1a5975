// A board beside metal at rest: calibrated with virtual dipoles by the product's own tools, it tracks between the calibrated
// places.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "core/protocol/convert.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

using virtual_board::BoardCircuit;

constexpr std::uint64_t kBoard = 4;
constexpr int kCoilRests = 48;  // of the calibration of the coils
const protocol::ModeRequest kColumns{240'000, signal::Multiplexing::tdm, true};
const protocol::ModeRequest kPoses{240'000, signal::Multiplexing::tdm, false};

/// Nodes of a grid around the middle of the workspace, in random attitudes.
std::vector<sim::Pose> grid(int nodes, double spacing_m, std::mt19937_64& random) {
    std::vector<sim::Pose> poses;
    for (int n = 0; n < nodes * nodes * nodes; ++n) {
        const Vec3<double> node = Vec3<int>(n % nodes, n / nodes % nodes, n / (nodes * nodes)).cast<double>();
        const Vec3<double> from_middle = node - Vec3<double>::Constant(0.5 * (nodes - 1));
        poses.push_back({Vec3<double>(0.45, 0, 0.05) + spacing_m * from_middle, test::random_attitude(random)});
    }
    return poses;
}

struct Errors {
    double rms_mm = 0;
    double worst_mm = 0;
    int valid = 0;  // places where each pose is valid
};

/// Errors of the mean position that the board's tracker reports at each place, valid or not.
Errors errors_of(const test::Measured& measured, const std::vector<sim::Pose>& truths) {
    Errors errors;
    for (std::size_t n = 0; n < truths.size(); ++n) {
        const auto& messages = measured.poses[n];
        EXPECT_FALSE(messages.empty());
        Vec3<double> mean_m = Vec3<double>::Zero();
        bool all_valid = true;
        for (const protocol::PoseMessage& message : messages) {
            tracking::PoseEstimate<double> pose;
            EXPECT_EQ(from_message(message, pose), protocol::WireError::none);
            mean_m += pose.position_m / static_cast<double>(messages.size());
            all_valid = all_valid && pose.valid();
        }
        const double error_mm = 1e3 * (mean_m - truths[n].position_m).norm();
        errors.rms_mm = std::hypot(errors.rms_mm, error_mm / std::sqrt(static_cast<double>(truths.size())));
        errors.worst_mm = std::max(errors.worst_mm, error_mm);
        errors.valid += all_valid ? 1 : 0;
    }
    return errors;
}

/// Coils with the virtual dipoles that `tricoil calibrate surroundings` finds at these poses.
host::CalibrationFile with_surroundings(const host::CalibrationFile& coils, const host::PoseFile& rests) {
    std::string table = std::string(host::kPoseCsvHeader) + "\n";
    for (const host::MeasuredPose& pose : rests.poses) {
        const Vec3<double>& p = pose.stage_position_m;
        const Quat<double> q(pose.stage_rotation);
        table += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{}\n", p.x(), p.y(), p.z(), q.w(), q.x(),
                             q.y(), q.z(), host::matrix_text(pose.x));
    }
    const std::string room = test::path_in_temp("room.toml");
    const auto run = test::tricoil("calibrate surroundings --calibration " + test::write_file("coils.toml", to_toml(coils)) +
                                   " --out " + room + " " + test::write_file(rests.path, table));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return host::read_calibration(room);
}

TEST(Surroundings, BoardAboveATableTracksBetweenTheCalibratedNodes) {
    const BoardCircuit circuit = BoardCircuit::draw(kBoard);
    const host::CalibrationFile coils = test::calibrate(circuit, kColumns, kBoard, kCoilRests);
    std::mt19937_64 random(kBoard);
    const auto nodes = grid(3, 0.2, random);
    const auto coils_blob = calibration::encode(coils.calibration);  // the board corrects its converters
    const auto above_table = test::measure(circuit, host::load_scenario("table", 1), kColumns, nodes, &coils_blob);
    const host::CalibrationFile with_table = with_surroundings(coils, test::means_of(above_table.frames, nodes));

    const auto between = grid(2, 0.13, random);
    std::array<Errors, 2> errors;  // coils alone, coils and table
    for (std::size_t n = 0; n < 2; ++n) {
        const auto blob = calibration::encode((n == 0 ? coils : with_table).calibration);
        errors[n] = errors_of(test::measure(circuit, host::load_scenario("table", 1), kPoses, between, &blob), between);
        std::printf("%s: %.2f mm RMS, %.2f mm at most, %d of %zu places\n", n == 0 ? "coils" : "coils and table",
                    errors[n].rms_mm, errors[n].worst_mm, errors[n].valid, between.size());
    }
    EXPECT_EQ(errors[1].valid, static_cast<int>(between.size()));
    EXPECT_EQ(errors[0].valid, 0) << "a pose that metal distorts is not valid";
    EXPECT_GT(errors[0].rms_mm, 10 * errors[1].rms_mm);
    EXPECT_LT(errors[1].rms_mm, 1);
}

}  // namespace
}  // namespace tricoil
