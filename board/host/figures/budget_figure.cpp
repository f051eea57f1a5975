#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>

#include "board/host/figures/figures.hpp"
#include "board/support/errors.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "board/support/whole_file.hpp"
#include "core/base/angle_units.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/paper/tdm_experiment.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

struct NamedMotion {
    std::string name;
    std::unique_ptr<sim::Motion> motion;
    double duration_s;
};

std::vector<NamedMotion> recorded_motions(const fs::path& recordings, const InterruptGuard& guard) {
    std::vector<fs::path> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(recordings, error)) {
        if (entry.path().extension() == ".traj") {
            files.push_back(entry.path());
        }
    }
    refuse_if(files.empty(), "no .traj files in {}; give another folder with --hand-motion", recordings.string());
    std::sort(files.begin(), files.end());
    std::vector<NamedMotion> motions;
    for (const fs::path& file : files) {
        guard.check();
        auto motion = std::make_unique<sim::RecordedMotion>(read_trajectory(file.string()), sim::RecordedMotionParams{});
        const double duration_s = motion->duration_s();
        motions.push_back({file.stem().string(), std::move(motion), duration_s});
    }
    return motions;
}

std::vector<NamedMotion> generated_motions() {
    std::vector<NamedMotion> motions;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        motions.push_back(
            {fmt::format("generated{}", seed), std::make_unique<sim::HandMotion>(Vec3<double>(0.9, 0, 0), seed), 5.0});
    }
    return motions;
}

void write_instants(const fs::path& file, const std::vector<paper::TdmPose>& poses) {
    std::string text = "time_s,measured_x_m,measured_y_m,measured_z_m,predicted_x_m,predicted_y_m,predicted_z_m\n";
    for (const paper::TdmPose& pose : poses) {
        fmt::format_to(std::back_inserter(text), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", pose.time_s,
                       pose.measured(0), pose.measured(1), pose.measured(2), pose.predicted(0), pose.predicted(1),
                       pose.predicted(2));
    }
    write_whole_file(file, text);
}

}  // namespace

void write_budget_figure(const fs::path& folder, const fs::path& recordings, const InterruptGuard& guard,
                         const ShowShare& progress) {
    const auto motions = recordings.empty() ? generated_motions() : recorded_motions(recordings, guard);
    std::string table =
        "motion,poses,measured_position_rms_mm,predicted_position_rms_mm,device_position_rms_mm,measured_rotation_rms_deg,"
        "predicted_rotation_rms_deg,device_rotation_rms_deg,position_correlation,rotation_correlation\n";
    for (std::size_t n = 0; n < motions.size(); ++n) {
        guard.check();
        progress(static_cast<double>(n) / static_cast<double>(motions.size()));
        paper::TdmParams params;
        params.duration_s = motions[n].duration_s;
        const auto poses = paper::simulate_tdm(*motions[n].motion, params);
        const auto r = paper::summarise(poses);
        fmt::format_to(std::back_inserter(table), "{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6f},{:.6f}\n",
                       motions[n].name, r.poses, 1e3 * r.measured_position_rms_m, 1e3 * r.predicted_position_rms_m,
                       1e3 * r.device_position_rms_m, kDegrees * r.measured_rotation_rms_rad,
                       kDegrees * r.predicted_rotation_rms_rad, kDegrees * r.device_rotation_rms_rad, r.position_correlation,
                       r.rotation_correlation);
        if (n == 0) {
            write_instants(folder / "budget_instants.csv", poses);
        }
    }
    write_whole_file(folder / "budget.csv", table);
}

}  // namespace tricoil::host
