// Compares Raab's closed form of 1981 with the direct and the refined solver on the same couplings: accuracy against the stage
// and time ratio. Uses recorded couplings if present (TRICOIL_DATA_DIR), else generated ones.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "tests/bench/raab.hpp"
#include "tests/support/recordings.hpp"
#include "tests/support/temporary_path.hpp"
#include "tests/support/triads/data_set.hpp"

namespace {

using namespace tricoil;

std::vector<std::string> recorded(const std::string& suffix) {
    const std::string folder = test::recordings_folder("ilemt-concentric");
    if (folder.empty()) {
        return {};
    }
    std::vector<std::string> paths;
    for (int fixture = 0; fixture < 3; ++fixture) {
        paths.push_back(folder + "/" + sim::ilemt_name(fixture, suffix));
    }
    return paths;
}

std::vector<std::string> generated(const std::string& suffix, std::uint64_t seed) {
    const auto triads = sim::make_triads(0.002, 2, 0.015, 4);
    sim::StageParams stage;
    stage.noise_share = 1e-4;
    stage.seed = seed;
    std::vector<std::string> paths;
    for (int fixture = 0; fixture < 3; ++fixture) {
        paths.push_back(test::path_in_temp(sim::ilemt_name(fixture, suffix)));
        std::ofstream(paths.back()) << sim::ilemt_text(triads, stage, fixture);
    }
    return paths;
}

struct Accuracy {
    double position_m = 0;
    double orientation_deg = 0;
};

/// Time of one call: the shortest of several batches, because other programs only lengthen it.
template <typename Call>
double shortest_s(const Call& call) {
    constexpr int kBatches = 5;
    constexpr int kCalls = 10;
    double shortest = 1e9;
    for (int batch = 0; batch < kBatches; ++batch) {
        const auto start = std::chrono::steady_clock::now();
        for (int n = 0; n < kCalls; ++n) {
            call();
        }
        shortest = std::min(shortest, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / kCalls);
    }
    return shortest;
}

/// RMS error of `solve` (position up to its sign, O) against the stage, and the sum over the poses of the time of one call.
template <typename Solve>
Accuracy measure(const host::CalibrationFit& fit, const std::vector<host::PoseFile>& files, Solve solve, double& seconds) {
    Accuracy sum;
    double poses = 0;
    seconds = 0;
    for (const host::PoseFile& file : files) {
        for (const host::MeasuredPose& pose : file.poses) {
            const auto truth = host::true_pose(fit.source_stage.at(host::source_fixture_name(file)), pose,
                                               fit.mount_sensor.at(host::sensor_fixture_name(file)));
            bench::RaabPose answer;
            seconds += shortest_s([&] {
                answer = solve(pose.x, truth);
                benchmark::DoNotOptimize(answer);
            });
            const double side = answer.position_m.dot(truth.position_m) < 0 ? -1 : 1;
            const double turn = geometry::angle_between(geometry::attitude_quaternion(answer.attitude), truth.q_source_sensor);
            sum.position_m += (side * answer.position_m - truth.position_m).squaredNorm();
            sum.orientation_deg += std::pow(turn * 180 / std::numbers::pi, 2);
            poses += 1;
        }
    }
    return {std::sqrt(sum.position_m / poses), std::sqrt(sum.orientation_deg / poses)};
}

void print(const char* name, const Accuracy& a, double time_ratio) {
    std::printf("%-34s %8.4f mm %8.4f deg   %7.2f times the direct solver's time\n", name, 1e3 * a.position_m, a.orientation_deg,
                time_ratio);
}

}  // namespace

int main() {
    const bool real = !recorded("md").empty();
    const auto md = host::read_pose_files(real ? recorded("md") : generated("md", 1));
    const auto ld = host::read_pose_files(real ? recorded("ld") : generated("ld", 2));
    host::FitOptions options;
    options.model = host::FitModel::concentric;
    const auto concentric = host::fit_calibration(md, options);
    options.model = host::FitModel::general;
    const auto general = host::fit_calibration(md, options);
    const Mat3<double> sensor = concentric.model.sensor_sensitivity.transpose().inverse();
    const Mat3<double> source = concentric.model.source_moment.inverse();
    double direct_s = 0;
    double raab_s = 0;
    double refined_s = 0;
    const auto direct = measure(
        concentric, ld,
        [&](const Mat3<double>& x, const auto&) -> bench::RaabPose {
            const Mat3<double> ideal = sensor * x * source;
            const auto s = solver::solve_direct<double>(ideal, 1.0);
            return {s->range_m * s->direction, s->attitude};
        },
        direct_s);
    const auto raab = measure(
        concentric, ld, [&](const Mat3<double>& x, const auto&) { return bench::solve_raab(sensor * x * source, 1.0); }, raab_s);
    const auto refined = measure(
        general, ld,
        [&](const Mat3<double>& x, const auto& truth) -> bench::RaabPose {
            solver::ColdStartParams<double> params;
            params.hemisphere = truth.position_m;
            const auto s = solver::solve_cold<double>(general.model, x, Mat3<double>::Ones(), params);
            return {s->refinement.pose.position_m, s->refinement.pose.q_source_sensor.toRotationMatrix().transpose()};
        },
        refined_s);
    std::printf("%zu %s poses; fixtures and gains are fitted to the calibration set\n", host::count_poses(ld),
                real ? "recorded" : "generated");
    print("Raab 1981, concentric gains", raab, raab_s / direct_s);
    print("direct, concentric gains", direct, 1);
    print("refined cold, general model", refined, refined_s / direct_s);
    return 0;
}
