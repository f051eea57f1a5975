// A virtual board that measures a sensor at rest at one pose after the other, and its calibration from these rests.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "core/calibration/blob.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil::test {

constexpr double kBeginS = BoardBench::kBootS + 0.4;
constexpr double kStayS = 0.5;
constexpr double kUsedS = 0.25;  // at the end of a rest

class Rests final : public sim::Motion {
public:
    explicit Rests(std::vector<sim::Pose> poses) : poses_(std::move(poses)) {}

private:
    [[nodiscard]] sim::Pose do_at(double time_s) const override {
        const double rest = std::clamp((time_s - kBeginS) / kStayS, 0.0, static_cast<double>(poses_.size()) - 1);
        return poses_[static_cast<std::size_t>(rest)];
    }
    std::vector<sim::Pose> poses_;
};

inline Quat<double> random_attitude(std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    return Quat<double>(normal(random), normal(random), normal(random), normal(random)).normalized();
}

inline sim::Pose random_pose(double range_m, std::mt19937_64& random) {
    std::normal_distribution<double> normal(0, 1);
    Vec3<double> direction(normal(random), normal(random), normal(random));
    direction.x() = std::abs(direction.x());  // the hemisphere of the tracker
    return {range_m * direction.normalized(), random_attitude(random)};
}

/// Number of the rest whose used part contains a time; empty outside.
inline std::optional<std::size_t> rest_at(std::int64_t time_us, std::size_t rests) {
    const double rest = (1e-6 * static_cast<double>(time_us) - kBeginS) / kStayS;
    const double part_s = (rest - std::floor(rest)) * kStayS;
    const bool is_used = rest >= 0 && rest < static_cast<double>(rests) && part_s > kStayS - kUsedS && part_s < kStayS - 0.02;
    return is_used ? std::optional(static_cast<std::size_t>(rest)) : std::nullopt;
}

/// A complete signal matrix, and the levels at the converters.
struct RestFrame {
    Mat3<double> x;
    host::SignalLevels levels;
};
using RestFrames = std::vector<std::vector<RestFrame>>;

/// What a board sends about the used part of each rest.
struct Measured {
    RestFrames frames;
    std::vector<std::vector<protocol::PoseMessage>> poses;  // of the board's tracker
};

inline RestFrames frames_of(const std::vector<protocol::ColumnMessage>& columns, std::size_t rests) {
    RestFrames frames(rests);
    RestFrame frame;
    int have = 0;
    for (const protocol::ColumnMessage& column : columns) {
        const auto rest = rest_at(column.time_us, rests);
        const int j = column.state - 1;
        have = rest && flag_bits(column) == 0 && j == have ? have + 1 : 0;
        if (have == 0) {
            continue;
        }
        for (int i = 0; i < kSensorCoils; ++i) {
            const auto coil = static_cast<std::size_t>(i);
            frame.x(i, j) = static_cast<double>(column.in_phase[coil]);
            frame.levels.share(i, j) = column.level[coil] / static_cast<double>(kLevelsPerFullScale);
        }
        frame.levels.gain_step = column.flags >> protocol::kGainStepBit;
        if (have == kSourceCoils) {
            frames[*rest].push_back(frame);
            have = 0;
        }
    }
    return frames;
}

/// Measures in `mode` at these poses, with the metal of `scenario`. With a calibration the board stores it first.
inline Measured measure(const virtual_board::BoardCircuit& circuit, sim::Scenario scenario, protocol::ModeRequest mode,
                        const std::vector<sim::Pose>& poses, const calibration::Blob* blob) {
    scenario.motion = std::make_unique<Rests>(poses);
    BoardBench bench(std::move(scenario), circuit);
    bench.run(BoardBench::kBootS);
    HostEnd& host = bench.host(on_usb);
    host.hello();
    bench.run(0.01);
    if (blob != nullptr) {
        bench.press_button();
        host.write(*blob);
        for (int n = 0; n < 20 && !host.result(); ++n) {
            bench.run(0.002);
        }
        EXPECT_EQ(host.result(), protocol::AckResult::done) << "the board refuses the calibration";
    }
    EXPECT_EQ(bench.ask(on_usb, protocol::Opcode::mode, protocol::mode_argument(mode)), protocol::AckResult::done);
    EXPECT_EQ(bench.ask(on_usb, protocol::Opcode::start), protocol::AckResult::done);
    bench.fed[on_usb] = true;
    bench.run(kBeginS + kStayS * static_cast<double>(poses.size()) - bench.board->now_s());
    Measured measured{frames_of(host.columns, poses.size()), {}};
    measured.poses.resize(poses.size());
    for (const protocol::PoseMessage& pose : host.poses) {
        if (const auto rest = rest_at(pose.time_us, poses.size())) {
            measured.poses[*rest].push_back(pose);
        }
    }
    return measured;
}

inline host::MeasuredPose at(const sim::Pose& pose, const Mat3<double>& x, std::size_t line = 1) {
    return {{x}, pose.position_m, pose.q_source_sensor.toRotationMatrix(), line};
}

/// One pose for each rest, with the mean of its signal matrices and the levels of its last.
inline host::PoseFile means_of(const RestFrames& frames, const std::vector<sim::Pose>& poses) {
    host::PoseFile file;
    file.path = "rests";
    for (std::size_t n = 0; n < poses.size(); ++n) {
        EXPECT_GT(frames[n].size(), 20U) << n;
        Mat3<double> mean = Mat3<double>::Zero();
        for (const RestFrame& frame : frames[n]) {
            mean += frame.x / static_cast<double>(frames[n].size());
        }
        file.poses.push_back(at(poses[n], mean, n + 1));
        file.poses.back().levels = frames[n].back().levels;
    }
    return file;
}

/// The calibration of `tricoil calibrate stage --model concentric` from rests at random poses at 0.28 to 1.22 m, without metal;
/// with
/// --converters in TDM.
inline host::CalibrationFile calibrate(const virtual_board::BoardCircuit& circuit, protocol::ModeRequest mode, std::uint64_t seed,
                                       int rests) {
    constexpr double kNearest_m = 0.28;
    constexpr double kFarthest_m = 1.22;
    std::mt19937_64 random(seed);
    std::vector<sim::Pose> poses;
    for (int n = 0; n < rests; ++n) {
        poses.push_back(random_pose(kNearest_m + (kFarthest_m - kNearest_m) * n / (rests - 1), random));
    }
    std::vector<host::PoseFile> files{
        means_of(measure(circuit, host::load_scenario("still", 1), mode, poses, nullptr).frames, poses)};
    host::FitOptions options;
    options.model = host::FitModel::concentric;
    options.finds_pick_up = true;
    host::ConverterFit converters;
    if (mode.multiplexing == signal::Multiplexing::tdm) {
        converters = fit_converters(files, options);
    } else {
        converters.coils = fit_calibration(files, options);
    }
    const host::CalibrationFit& fit = converters.coils;
    host::CalibrationFile calibrated;
    calibrated.calibration.converters = converters.errors;
    calibrated.calibration.pick_up = {fit.pick_up, Mat3<double>::Zero(), fit.pick_up_sigma};
    for (host::MeasuredPose& pose : files[0].poses) {
        pose.x -= fit.pick_up;
    }
    calibrated.calibration.model = fit.model;
    calibrated.calibration.hemisphere = Vec3<double>::UnitX();
    calibrated.model = "concentric";
    calibrated.source_stage = fit.source_stage;
    calibrated.mount_sensor = fit.mount_sensor;
    const auto errors = evaluate(calibrated, files, host::EvaluationSolver::direct);
    calibrated.calibration.misfit_floor = host::misfit_floor_of(errors, fit.outliers.size());
    return calibrated;
}

}  // namespace tricoil::test
