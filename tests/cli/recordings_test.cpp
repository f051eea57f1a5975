// Recordings of real hardware and real hand motions (not part of this project).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/recordings.hpp"

namespace tricoil::test {
namespace {

class Recordings : public ::testing::Test {
protected:
    void SetUp() override {
        folder_ = recordings_folder();
        if (folder_.empty()) {
            GTEST_SKIP() << "no recordings: set TRICOIL_DATA_DIR to a folder with hand-motion/ and adc-captures/";
        }
    }
    std::string capture(const std::string& name) const {
        return folder_ + "/adc-captures/" + name + " --carrier-hz 10000 --rate-hz 200000 --json";
    }
    std::string folder_;
};

#ifdef TRICOIL_WITH_PYTHON
TEST_F(Recordings, ADistantSensorIsDetected) {
    const auto result = tricoil("demodulate " + capture("far_sensor.csv"));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = result.json();
    EXPECT_EQ(json["reference_channel"], 3);
    EXPECT_EQ(json["repeats"], 10);
    EXPECT_GT(json["determinant"].get<double>(), 0);
    EXPECT_NEAR(json["snr_db"].get<double>(), 31.3, 1);
    EXPECT_LT(json["misfit_share"].get<double>(), 0.05);
}

TEST_F(Recordings, OpenInputsAreReportedAsNoSensor) {
    const auto result = tricoil("demodulate " + capture("no_sensor.csv"));
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, ::testing::HasSubstr("no sensor"));
    EXPECT_GT(result.json()["misfit_share"].get<double>(), 0.15);
}
#endif

TEST_F(Recordings, AHandIsTrackedToTheBoundWithFdm) {
    const std::string options = "run --json --trajectory " + folder_ + "/hand-motion/user1_cup0.traj";
    const auto fdm = tricoil(options + " --mux fdm --tracker direct").json();
    EXPECT_LT(fdm["position_rms_m"].get<double>(), 1.2 * fdm["bound_position_rms_m"].get<double>());
    EXPECT_EQ(fdm["poses_invalid"], 0);
    const auto tdm = tricoil(options + " --mux tdm --tracker previous --no-deskew").json();
    EXPECT_GT(tdm["position_rms_m"].get<double>(), 4e-3);
    EXPECT_LT(tdm["position_rms_m"].get<double>(), 10e-3);
}

/// The path ends in full motion. Predictions are compared with it, not with a sensor that stops there.
TEST_F(Recordings, PredictionsEndWithThePath) {
    const std::string options =
        "run --json --no-noise --mux tdm --tracker scaat --trajectory " + folder_ + "/hand-motion/user1_cup0.traj --predict ";
    const auto near = tricoil(options + "0.005").json();
    const auto far = tricoil(options + "0.02").json();
    EXPECT_LT(near["position_max_m"].get<double>(), 0.5e-3);
    EXPECT_LT(far["position_max_m"].get<double>(), 3e-3);
    EXPECT_NEAR(near["duration_s"].get<double>() - far["duration_s"].get<double>(), 0.015, 0.0015);
}

}  // namespace
}  // namespace tricoil::test
