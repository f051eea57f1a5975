// The error budget against simulation on recorded hand motions; skipped without the recordings.
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <vector>

#include "board/support/sim_input/trajectory_file.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "tests/error_model/corrected_tdm.hpp"
#include "tests/error_model/tdm_experiment.hpp"
#include "tests/error_model/tdm_report.hpp"
#include "tests/support/recordings.hpp"

namespace tricoil::paper {
namespace {

TEST(HandMotion, BudgetPredictsTheNaiveErrorOfEveryFile) {
    const auto files = test::recorded_motion_files();
    if (files.empty()) {
        GTEST_SKIP() << "no recorded hand motions: set TRICOIL_DATA_DIR to a folder with hand-motion/";
    }
    double lowest_correlation = 1;
    double worst_ratio = 0;
    double least_gain = 1e9;
    for (const std::string& file : files) {
        const sim::RecordedMotion motion(host::read_trajectory(file), {});
        TdmParams params;
        params.duration_s = motion.duration_s();
        const auto poses = simulate_tdm(motion, params);
        const ErrorPart of_position = summarise(poses, 0);
        const ErrorPart of_rotation = summarise(poses, 3);
        const double position = of_position.predicted_rms / of_position.measured_rms - 1;
        const double rotation = of_rotation.predicted_rms / of_rotation.measured_rms - 1;
        EXPECT_LT(std::abs(position), 0.1) << file;
        EXPECT_LT(std::abs(rotation), 0.1) << file;
        EXPECT_LT(std::abs(of_position.device_rms / of_position.measured_rms - 1), 0.1) << file;
        EXPECT_GT(of_position.correlation, 0.9) << file;
        std::cout << std::filesystem::path(file).filename().string() << ": measured " << 1e3 * of_position.measured_rms
                  << " mm, predicted " << 1e3 * of_position.predicted_rms << " mm, correlation " << of_position.correlation
                  << " (position) " << of_rotation.correlation << " (orientation)\n";
        const CorrectedTdm corrected = corrected_tdm<double>(motion, params);
        EXPECT_GT(corrected.gain(), 20) << file;
        least_gain = std::min(least_gain, corrected.gain());
        lowest_correlation = std::min(lowest_correlation, of_position.correlation);
        worst_ratio = std::max({worst_ratio, std::abs(position), std::abs(rotation)});
    }
    std::cout << files.size() << " files: RMS off by at most " << 100 * worst_ratio << " %, correlation at least "
              << lowest_correlation << ", errors of corrected poses at least " << least_gain << " times smaller\n";
}

}  // namespace
}  // namespace tricoil::paper
