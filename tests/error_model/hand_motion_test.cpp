// The error budget against simulation on recorded hand motions; skipped where the recordings are not.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <vector>

#include "board/support/sim_input/trajectory_file.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/paper/tdm_experiment.hpp"

namespace tricoil::paper {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> recordings() {
    const char* const set = std::getenv("TRICOIL_DATA_DIR");
    const fs::path folder = fs::path(set != nullptr ? set : TRICOIL_DEFAULT_DATA_DIR) / "hand-motion";
    std::vector<fs::path> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".traj") {
            files.push_back(entry.path());
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

TEST(HandMotion, BudgetPredictsTheNaiveErrorOfEveryFile) {
    const auto files = recordings();
    if (files.empty()) {
        GTEST_SKIP() << "no recorded hand motions; set TRICOIL_DATA_DIR to the folder that holds hand-motion/*.traj";
    }
    double lowest_correlation = 1;
    double worst_ratio = 0;
    for (const fs::path& file : files) {
        const sim::RecordedMotion motion(host::read_trajectory(file.string()), {});
        TdmParams params;
        params.duration_s = motion.duration_s();
        const TdmReport r = summarise(simulate_tdm(motion, params));
        const double position = r.predicted_position_rms_m / r.measured_position_rms_m - 1;
        const double rotation = r.predicted_rotation_rms_rad / r.measured_rotation_rms_rad - 1;
        EXPECT_LT(std::abs(position), 0.1) << file;
        EXPECT_LT(std::abs(rotation), 0.1) << file;
        EXPECT_LT(std::abs(r.device_position_rms_m / r.measured_position_rms_m - 1), 0.1) << file;
        EXPECT_GT(r.position_correlation, 0.9) << file;
        std::cout << file.filename().string() << ": measured " << 1e3 * r.measured_position_rms_m << " mm, predicted "
                  << 1e3 * r.predicted_position_rms_m << " mm, correlation " << r.position_correlation << " (position) "
                  << r.rotation_correlation << " (orientation)\n";
        lowest_correlation = std::min(lowest_correlation, r.position_correlation);
        worst_ratio = std::max({worst_ratio, std::abs(position), std::abs(rotation)});
    }
    std::cout << files.size() << " files: RMS off by at most " << 100 * worst_ratio << " %, correlation at least "
              << lowest_correlation << "\n";
}

}  // namespace
}  // namespace tricoil::paper
