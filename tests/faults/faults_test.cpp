// Commands on failing disks: no success is reported, and no file is incomplete.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;

/// Runs with a failure of the `count`-th `call` on `path`; empty `call`: no failure.
CliResult tricoil_with_fault(const std::string& arguments, const std::string& call, int count, int error,
                             const std::string& path) {
    // ASAN_OPTIONS: the address sanitizer wants to be the first library.
    const std::string setup =
        "export ASAN_OPTIONS=verify_asan_link_order=0 LD_PRELOAD=" TRICOIL_FAULT_INJECTION " TRICOIL_FAULT=" + call + ":" +
        std::to_string(count) + ":" + std::to_string(error) + ":" + path;
    return tricoil(arguments, setup);
}

/// Couplings of concentric coils at 150 poses, as `tricoil calibrate` reads them: x = r^T (3 u u^T - 1) / p^3, up to a constant.
std::string pose_table() {
    std::string text = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33\n";
    for (int n = 0; n < 150; ++n) {
        const int row = n / 5 % 6;
        const int layer = n / 30;
        const Eigen::Vector3d p(0.3 + 0.02 * (n % 5), -0.1 + 0.02 * row, -0.1 + 0.03 * layer);
        const Eigen::Quaterniond q(Eigen::AngleAxisd(0.5 * (n % 3), Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(0.4 * (n % 4), Eigen::Vector3d::UnitX()));
        const Eigen::Vector3d u = p.normalized();
        const Eigen::Matrix3d field = 1e-3 * (3 * u * u.transpose() - Eigen::Matrix3d::Identity()) / std::pow(p.norm(), 3);
        const Eigen::Matrix3d x = q.toRotationMatrix().transpose() * field;
        text += fmt::format("{},{},{},{:.9f},{:.9f},{:.9f},{:.9f}", p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
        for (int i = 0; i < 3; ++i) {
            text += fmt::format(",{:.9e},{:.9e},{:.9e}", x(i, 0), x(i, 1), x(i, 2));
        }
        text += "\n";
    }
    return text;
}

/// Samples of four converters at 200 kHz, two repeats: a carrier of 10 kHz with 20,000 codes in the reference, 2,000 in one
/// sensor channel and 200 in the others.
std::string capture_text() {
    constexpr int kSamples = 200;
    std::string text = "state,repeat,sample,adc0,adc1,adc2,adc3\n";
    for (int block = 0; block < 6; ++block) {
        const int state = 1 + block % 3;
        const int repeat = block / 3;
        for (int n = 0; n < kSamples; ++n) {
            const double carrier = std::sin(2 * std::numbers::pi * n / 20);
            const auto code = [&](int channel) { return std::lround((channel == state ? 2000 + repeat : 200) * carrier); };
            text += fmt::format("S{},{},{},{},{},{},{}\n", state, repeat, n, code(1), code(2), code(3),
                                std::lround(20'000 * carrier));
        }
    }
    return text;
}

class Faults : public ::testing::Test {
protected:
    void SetUp() override {  // not SetUpTestSuite: after a failure there, ctest counts the tests as skipped
        recording_ = path_in_temp("recording");
        fs::remove_all(recording_);
        // Its tables need several reads. Each of them fails, which takes two runs of a command.
        ASSERT_EQ(tricoil("run --scenario still --duration 0.4 --record " + recording_).exit_code, 0);
        poses_ = write_file("sOx_sEx.csv", pose_table());
        capture_ = write_file("capture.csv", capture_text());
        calibration_ = path_in_temp("calibration.toml");
#ifdef TRICOIL_WITH_PYTHON
        const auto fitted = tricoil("calibrate stage --model concentric --out " + calibration_ + " " + poses_);
        ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
#endif
    }

    /// Lets only the `count`-th `call` fail: the command fails, or does not need the call and gives the complete result.
    static void expect_survives_once(const std::string& arguments, const std::string& call, int count, const std::string& path,
                                     const std::string& out, const CliResult& whole, const std::string& expected) {
        fs::remove(out);
        const auto result = tricoil_with_fault(arguments, "'" + call + "!'", count, EIO, path);
        if (result.exit_code == 0) {
            EXPECT_EQ(read_file(out), expected) << arguments << ": " << call << " " << count;
            EXPECT_EQ(result.out, whole.out) << arguments << ": " << call << " " << count;
            return;
        }
        EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 3) << arguments << ": " << call << " " << count << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_TRUE(!fs::exists(out) || read_file(out) == expected) << arguments << ": " << call << " " << count;
    }

    /// Lets the first `call` on `path` fail, then the second, and so on, until the command succeeds; also with a single failure.
    static int expect_each_is_told(const std::string& arguments, const std::string& call, const std::string& path,
                                   const std::string& out) {
        fs::remove(out);
        const auto whole = tricoil(arguments);
        EXPECT_EQ(whole.exit_code, 0) << whole.err;
        const std::string expected = read_file(out);
        constexpr int kMax = 200;
        for (int count = 1; count < kMax; ++count) {
            expect_survives_once(arguments, call, count, path, out, whole, expected);
            fs::remove(out);
            const auto result = tricoil_with_fault(arguments, call, count, EIO, path);
            if (result.exit_code == 0) {
                EXPECT_EQ(read_file(out), expected) << arguments << ": " << call << " " << count;
                EXPECT_EQ(result.out, whole.out) << arguments << ": " << call << " " << count;
                return count - 1;
            }
            EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 3)
                << arguments << ": " << call << " " << count << result.err;
            EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
            EXPECT_FALSE(fs::exists(out)) << arguments << ": " << call << " " << count;
        }
        ADD_FAILURE() << arguments << ": " << call << " never stops failing";
        return kMax;
    }

    static inline std::string recording_;
    static inline std::string poses_;
    static inline std::string capture_;
    static inline std::string calibration_;
    const std::string out_ = path_in_temp("out_file");
};

TEST_F(Faults, AFailedReadIsNotTheEndOfAFile) {
    const std::vector<std::pair<std::string, std::string>> commands{
        {"convert " + recording_ + " --out " + out_, recording_ + "/poses.csv"},
        {"convert " + recording_ + " --out " + out_, recording_ + "/recording.json"},
        {"replay " + recording_ + " --out " + out_, recording_ + "/inputs.csv"},
        {"replay " + recording_ + " --out " + out_, recording_ + "/poses.csv"},
#ifdef TRICOIL_WITH_PYTHON
        {"calibrate stage --model concentric --out " + out_ + " " + poses_, poses_},
        {"evaluate --calibration " + calibration_ + " " + poses_, poses_},
        {"evaluate --calibration " + calibration_ + " " + poses_, calibration_},
        {"demodulate " + capture_ + " --carrier-hz 10000 --rate-hz 200000", capture_},
#endif
    };
    for (const auto& [command, path] : commands) {
        EXPECT_GT(expect_each_is_told(command, "read", path, out_), 0) << command << ": " << path << " was never read";
    }
}

TEST_F(Faults, FailedReadInAKilledRecordingIsReported) {  // the file has no CRC
    const std::string killed = path_in_temp("killed");
    fs::remove_all(killed);
    fs::copy(recording_, killed);
    std::string description = read_file(killed + "/recording.json");
    const auto at = description.find("\"complete\": true");
    ASSERT_NE(at, std::string::npos);
    description.replace(at, 16, "\"complete\": false");
    fs::remove(killed + "/recording.json");
    std::ofstream(killed + "/recording.json") << description;
    EXPECT_GT(expect_each_is_told("convert " + killed + " --out " + out_, "read", killed + "/poses.csv", out_), 1);
    EXPECT_GT(expect_each_is_told("replay " + killed + " --out " + out_, "read", killed + "/inputs.csv", out_), 1);
}

TEST_F(Faults, OutputFileIsCompleteOrAbsent) {
    const std::vector<std::string> commands{
        "run --scenario still --duration 1 --json --out ",
        "convert " + recording_ + " --out ",
        "replay " + recording_ + " --out ",
#ifdef TRICOIL_WITH_PYTHON
        "calibrate stage --model concentric " + poses_ + " --out ",
#endif
    };
    for (const std::string& command : commands) {
        for (const char* call : {"open", "write", "fsync", "rename"}) {
            if (command.starts_with("run")) {  // contains the run time
                fs::remove(out_);
                const auto result = tricoil_with_fault(command + out_, call, 1, EIO, out_);
                EXPECT_NE(result.exit_code, 0) << call;
                EXPECT_FALSE(fs::exists(out_)) << call;
            } else {
                EXPECT_GT(expect_each_is_told(command + out_, call, out_, out_), 0) << command << call;
            }
        }
    }
}

TEST_F(Faults, AnOlderFileOutlivesAFailure) {
    write_file("out_file", "older");
    for (const char* call : {"write", "fsync", "rename"}) {
        EXPECT_NE(tricoil_with_fault("convert " + recording_ + " --out " + out_, call, 1, ENOSPC, out_).exit_code, 0);
        EXPECT_EQ(read_file(out_), "older") << call;
    }
}

/// Also that of the header of a WAV file, which is written again at the end.
TEST_F(Faults, AnInterruptedWriteIsRepeated) {
    const std::string run = "run --scenario still --duration 0.2 --record-wav " + out_;
    ASSERT_EQ(tricoil(run).exit_code, 0);
    const std::string whole = read_file(out_);
    int interrupted = 0;
    for (bool is_last = false; !is_last; ++interrupted) {
        const auto result = tricoil_with_fault(run, "'write!'", interrupted + 1, EINTR, out_);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(read_file(out_), whole);
        is_last = tricoil_with_fault(run, "'write!'", interrupted + 1, EIO, out_).exit_code == 0;  // there are no more
    }
    EXPECT_GT(interrupted, 2);
}

TEST_F(Faults, RecordingOnAFailingDiskIsReported) {
    const std::string folder = path_in_temp("failing");
    const std::string journal = folder + "/inputs.csv";  // never renamed
    const std::vector<std::pair<std::string, std::string>> faults = {{"open", folder},   {"write", folder}, {"fsync", folder},
                                                                     {"rename", folder}, {"open", journal}, {"write", journal},
                                                                     {"fsync", journal}, {"close", journal}};
    for (const auto& [call, path] : faults) {
        fs::remove_all(folder);
        const auto result = tricoil_with_fault("run --scenario still --duration 1 --json --record " + folder, call, 1, EIO, path);
        EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 3)
            << call << " " << path << ": " << result.exit_code << result.err;
    }
}

}  // namespace
}  // namespace tricoil::test
