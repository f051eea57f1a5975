#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <sstream>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kOptions = " --carrier-hz 10000 --rate-hz 200000 ";

/// Recording with the reference on channel 1, given couplings, 16-bit unsigned codes and noise.
std::string recording(const Eigen::Matrix3d& x, int repeats, double noise) {
    std::ostringstream text;
    text << "state,repeat,sample,adc0,adc1,adc2,adc3\n";
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal(0, noise);
    for (int repeat = 0; repeat < repeats; ++repeat) {
        for (int j = 0; j < 3; ++j) {
            for (int n = 0; n < 200; ++n) {
                const double angle = 2 * M_PI * 0.05 * n + 0.3 * repeat;
                text << "S" << j + 1 << "," << repeat << "," << n;
                for (int channel = 0; channel < 4; ++channel) {
                    const int row = channel == 0 ? 0 : channel - 1;
                    const double value = channel == 1 ? std::cos(angle) : x(row, j) * std::cos(angle + 0.4 + 0.05 * row);
                    text << "," << std::lround(32768 + 9000 * value + normal(random));
                }
                text << "\n";
            }
        }
    }
    return text.str();
}

Eigen::Matrix3d dipole() {
    const Eigen::Vector3d u = Eigen::Vector3d(1, 2, -1).normalized();
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix();
    return 0.2 * rotation * (1.5 * u * u.transpose() - 0.5 * Eigen::Matrix3d::Identity());
}

TEST(Demodulate, FindsReferenceMatrixAndScatter) {
    const auto result = tricoil("demodulate --json " + write_file("good.csv", recording(dipole(), 8, 20)) + kOptions);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = result.json();
    EXPECT_EQ(json["reference_channel"], 1);
    EXPECT_EQ(json["sensor_channels"], nlohmann::json({0, 2, 3}));
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const auto row = static_cast<Eigen::Index>(i);
            const auto column = static_cast<Eigen::Index>(j);
            EXPECT_NEAR(json["mean"][i][j].get<double>(), dipole()(row, column), 5e-4);
            EXPECT_NEAR(json["scatter"][i][j].get<double>(), 20 * 0.1 / 9000, 2e-4);
        }
    }
    EXPECT_GT(json["determinant"].get<double>(), 0);
    EXPECT_NEAR(json["estimated_sigma"].get<double>(), 20 * 0.1 / 9000, 0.3e-4);
    EXPECT_TRUE(json["flags"].empty());
}

TEST(Demodulate, ReportsAMissingSensor) {
    const auto alike =
        tricoil("demodulate " + write_file("alike.csv", recording(0.1 * Eigen::Matrix3d::Ones(), 8, 20)) + kOptions);
    EXPECT_EQ(alike.exit_code, 1);
    EXPECT_THAT(alike.err, HasSubstr("no sensor"));
    const auto silent = tricoil("demodulate " + write_file("silent.csv", recording(Eigen::Matrix3d::Zero(), 8, 20)) + kOptions);
    EXPECT_EQ(silent.exit_code, 1);
    EXPECT_THAT(silent.err, HasSubstr("no sensor"));
}

TEST(Demodulate, NamesEveryErrorWithItsLine) {
    const std::string good = recording(dipole(), 2, 20);
    const auto expect = [](const std::string& content, const std::string& says, const std::string& options = kOptions) {
        const auto result = tricoil("demodulate " + write_file("bad.csv", content) + options);
        EXPECT_EQ(result.exit_code, 2) << says;
        EXPECT_THAT(result.err, HasSubstr(says));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    };
    const auto header_end = good.find('\n') + 1;
    const std::string header = good.substr(0, header_end);
    expect("", "is empty");
    expect("a,b\n", "bad.csv:1: no column state; the header must have");
    expect(header, "no samples");
    expect(header + "S1,0,0,1,2,3\n", "bad.csv:2: 6 columns");
    expect(header + "S4,0,0,1,2,3,4\n", "bad.csv:2: state 'S4'");
    expect(header + "S1,0,0,1,2,nan,4\n", "bad.csv:2: adc2: 'nan' is not finite");
    expect(header + "S1,0,0,1,2,70000,4\n", "bad.csv:2: adc2: 70000 is not a whole number");
    expect(header + "S1,0,0,1,2,3.5,4\n", "3.5 is not a whole number");
    expect(header + "S1,0,1,1,2,3,4\n", "sample 1 instead of 0");
    expect(good.substr(0, good.size() / 2), "");
    expect(good.substr(0, good.rfind("S3,1,199")), "199 samples, the first has 200");
    expect(good, "whole cycles", " --carrier-hz 10123 --rate-hz 200000");
    expect(good, "Nyquist", " --carrier-hz 95000 --rate-hz 200000");
    expect(good, "sample rate", " --carrier-hz 10000 --rate-hz nan");
    expect(good, "cannot identify the reference channel", " --carrier-hz 20000 --rate-hz 200000");
    expect(good, "--bits", std::string(kOptions) + "--bits 99");
    expect(good, "guard", std::string(kOptions) + "--guard 200");
    expect(recording(dipole(), 1, 20), "one repeat");
    expect(std::string("state\0,", 7), "binary");
}

}  // namespace
}  // namespace tricoil::test
