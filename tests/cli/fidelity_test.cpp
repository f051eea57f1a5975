#include <gtest/gtest.h>

#include <string>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

nlohmann::json run(const std::string& arguments) {
    const CliResult result = tricoil("run --json " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.json();
}

/// A minute: the standard deviation of an RMS is about 1 %.
TEST(Fidelity, ColumnsGiveEveryTrackerTheRmsOfSamplesWithinThreePercent) {
    for (const char* mux : {"tdm", "fdm"}) {
        for (const char* tracker : {"direct", "previous", "scaat"}) {
            const std::string options = std::string("--duration 60 --mux ") + mux + " --tracker " + tracker;
            const auto samples = run(options);
            const auto columns = run(options + " --fidelity columns");
            for (const char* figure : {"position_rms_m", "orientation_rms_deg"}) {
                const double expected = samples[figure];
                EXPECT_NEAR(columns[figure].get<double>(), expected, 0.03 * expected) << options << ' ' << figure;
            }
            EXPECT_EQ(columns["poses_scored"], samples["poses_scored"]) << options;
        }
    }
}

}  // namespace
}  // namespace tricoil::test
