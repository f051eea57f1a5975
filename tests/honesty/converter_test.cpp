// Runs with 12-bit converters, whose step is larger than the noise: at most one of 1,000 valid poses is beyond five of its
// standard deviations.
#include <gtest/gtest.h>

#include <fstream>

#include "board/host/run/simulated_run.hpp"
#include "board/record/recording.hpp"
#include "tests/honesty/pose_table.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::test {
namespace {

constexpr int kSeeds = 8;

struct ConverterCase {
    const char* name;
    const char* motion;  // of the scenario
};

std::string scenario_with(const ConverterCase& c) {
    const std::string path = path_in_temp(std::string(c.name) + ".toml");
    std::ofstream(path) << "[motion]\n" << c.motion << "\n[world]\nconverter_bits = 12\n";
    return path;
}

host::RunOptions options_of(const std::string& scenario, const char* tracker) {
    host::RunOptions options;
    options.scenario = scenario;
    options.multiplexing = "tdm";
    options.tracker = tracker;
    options.show_live = false;
    return options;
}

PoseRow run_row(const std::string& scenario, const char* tracker) {
    PoseRow row;
    for (int seed = 1; seed <= kSeeds; ++seed) {
        host::RunOptions options = options_of(scenario, tracker);
        options.seed = static_cast<std::uint64_t>(seed);
        options.duration_s = 3;
        host::RunObservers observers;
        observers.each_pose = [&](const tracking::PoseEstimate<double>& estimate, const host::PoseError& error) {
            row.add(estimate, error.truth, tracking::CommonParams<double>{}.max_deviation_m);
        };
        host::run_simulated(options, observers);
    }
    return row;
}

class CoarseConverter : public ::testing::TestWithParam<ConverterCase> {};

TEST_P(CoarseConverter, DeviationsIncludeItsStep) {
    const std::string scenario = scenario_with(GetParam());
    PoseRow::print_header();
    for (const char* tracker : {"direct", "previous", "scaat"}) {
        const PoseRow row = run_row(scenario, tracker);
        row.print(std::string(GetParam().name) + " " + tracker);
        EXPECT_GT(row.valid, row.poses / 2);
        EXPECT_LE(row.beyond_share(), 1e-3);
    }
}

/// A replay computes the same deviations only if it knows the converters.
TEST(CoarseConverters, AreInTheRecording) {
    constexpr double kCode_v = 2.5 / 2048;
    host::RunOptions options = options_of(scenario_with({"recorded", "kind = \"hand\""}), "direct");
    options.duration_s = 0.1;
    options.record = path_in_temp("recording");
    host::run_simulated(options);
    const auto converter = host::Recording(options.record).settings().value().tracker.common.converter;
    EXPECT_NEAR(converter.coupling, kCode_v / 1.08, 1e-9);  // 1 V of reference, carrier of 10.8 kHz
    EXPECT_NEAR(converter.noise, 33e-9 * std::sqrt(72e3) / kCode_v, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Motion, CoarseConverter,
                         ::testing::Values(ConverterCase{"hand", "kind = \"hand\""},
                                           ConverterCase{"near", "kind = \"hand\"\ncentre_m = [0.4, 0.1, 0.1]"},
                                           ConverterCase{"still",
                                                         "kind = \"still\"\nposition_m = [0.45, 0.15, 0.1]\n"
                                                         "euler_deg = [20, 35, -50]"}),
                         [](const auto& motion) { return std::string(motion.param.name); });

}  // namespace
}  // namespace tricoil::test
