// The program with the simulated front end on a pseudo terminal: tracking, and all commands of `tricoil device` and `tricoil
// selfcheck --device`. Needs no test kernel.
#include <gmock/gmock.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "core/calibration/blob.hpp"
#include "tests/device/judged_poses.hpp"
#include "tests/device/program.hpp"
#include "tests/device/reference.hpp"

namespace tricoil {
namespace {

using nlohmann::json;
using test::position_m;
using test::Program;

test::CsvTable table(const std::string& path) { return test::CsvTable(test::read_text(path)); }

/// Rows of valid poses, by time. A process that is not scheduled in time may lose rows.
std::map<std::int64_t, std::size_t> valid_rows(const test::CsvTable& poses) {
    std::map<std::int64_t, std::size_t> found;
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        if (poses.text(row, "valid") == "1") {
            found[std::stoll(poses.text(row, "time_us"))] = row;
        }
    }
    return found;
}

class Pty : public ::testing::Test {
protected:
    void SetUp() override {
        std::string name = ::testing::TempDir() + "tricoil-pty-XXXXXX";
        ASSERT_NE(::mkdtemp(name.data()), nullptr);
        folder = name + "/";
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    /// Starts the front end, and waits until it has created the pseudo terminal.
    void plug_in(const std::string& options, const std::string& watchdog_us = "5000000") {
        std::filesystem::remove(in("line"));
        peer = std::make_unique<Program>(std::string(TRICOIL_FRONT_END) + " --link pty: --watchdog-us " + watchdog_us +
                                         " --patience-ms 5000 " + options + " >" + in("line") + " 2>" + in("front-end.err"));
        ASSERT_TRUE(test::eventually([&] { return test::read_text(in("line")).find('\n') != std::string::npos; }));
        device = "serial:" + test::lines(test::read_text(in("line"))).front();
    }
    [[nodiscard]] std::string in(const std::string& file) const { return folder + file; }

    /// Runs `tricoil ARGUMENTS` and returns its exit code. Output: `out` and `err`.
    int tricoil(const std::string& arguments) {
        Program program(std::string(TRICOIL_PROGRAM) + " " + arguments + " >" + in("out") + " 2>" + in("err"));
        const int code = program.wait();
        out = test::read_text(in("out"));
        err = test::read_text(in("err"));
        return code;
    }

    std::string folder;
    std::string device;
    std::string out;
    std::string err;
    std::unique_ptr<Program> peer;
};

TEST_F(Pty, PosesAreRelativeToTheReference) {
    plug_in("--duration 10");
    ASSERT_EQ(tricoil("run --json --device " + device + " --duration 1 --relative-to 1 --out " + in("poses.csv")), 0) << err;
    const test::CsvTable own = table(in("poses.csv"));
    const auto rows = valid_rows(own);
    EXPECT_GT(rows.size(), 100U);
    for (const auto& [time, row] : rows) {
        EXPECT_EQ(own.number(row, "x_m"), 0);
        EXPECT_EQ(own.number(row, "std_x_m"), 0);
    }
    const json first = json::parse(test::lines(out).front());
    EXPECT_EQ(first["position_m"], json::array({0.0, 0.0, 0.0}));
    (void)tricoil("run --device " + device + " --duration 1 --relative-to 2 --out " + in("absent.csv"));
    EXPECT_GT(table(in("absent.csv")).rows(), 100U);
    EXPECT_TRUE(valid_rows(table(in("absent.csv"))).empty());  // the device has no second sensor
}

TEST_F(Pty, JsonLinesHoldPosesAlone) {
    plug_in("--duration 10");
    ASSERT_EQ(tricoil("run --json-lines - --device " + device + " --duration 1 --out " + in("poses.csv")), 0) << err;
    EXPECT_THAT(err, ::testing::HasSubstr("columns"));  // the summary
    const auto rows = test::lines(out);
    EXPECT_GT(rows.size(), 100U);
    for (const std::string& row : rows) {
        EXPECT_TRUE(json::parse(row).contains("utc_s"));
    }
    EXPECT_GT(table(in("poses.csv")).rows(), 100U);
}

TEST_F(Pty, TracksBitForBitWithoutLoss) {
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("run --json --device " + device + " --duration 2 --out " + in("poses.csv")), 0) << err;
    test::expect_equal_poses(in("poses.csv"), {}, 2, 1400);
    const json summary = json::parse(test::lines(out).back());
    EXPECT_EQ(summary["columns_lost"], 0);
    EXPECT_EQ(summary["starts"], 1);
    EXPECT_EQ(summary["device"], device);
    EXPECT_EQ(summary["health"]["received"], summary["columns"]);
    EXPECT_EQ(summary["health"]["lost"], 0);
}

TEST_F(Pty, TheFrontEndEndsIfNoHostMeasures) {
    plug_in("--duration 60 --idle-s 1");
    EXPECT_EQ(peer->wait(), 0);
    const std::string report = test::read_text(in("line"));
    EXPECT_NE(report.find("\"slots\": 0"), std::string::npos) << report;
}

TEST_F(Pty, AVanishedLineIsReported) {
    plug_in("--duration 600");
    Program tracker(std::string(TRICOIL_PROGRAM) + " run --device " + device + " --out " + in("poses.csv") + " 2>" + in("err") +
                    " >" + in("out"));
    ASSERT_TRUE(test::eventually([&] { return test::lines(test::read_text(in("poses.csv"))).size() > 100; }));
    peer->send(SIGKILL);
    peer->wait();
    EXPECT_TRUE(test::eventually([&] { return test::read_text(in("err")).find("cannot be opened") != std::string::npos; }))
        << test::read_text(in("err"));
    tracker.send(SIGTERM);
    EXPECT_EQ(tracker.wait(), 0);
}

TEST_F(Pty, ASecondProgramIsToldThatTheLineIsInUse) {
    plug_in("--duration 600");
    Program first(std::string(TRICOIL_PROGRAM) + " run --device " + device + " --out " + in("poses.csv") + " 2>" +
                  in("first.err") + " >" + in("first.out"));
    const auto rows = [&] { return test::lines(test::read_text(in("poses.csv"))).size(); };
    ASSERT_TRUE(test::eventually([&] { return rows() > 100; }));
    EXPECT_EQ(tricoil("run --wait 0.5 --device " + device), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("another program uses it"));
    const auto before = rows();
    EXPECT_TRUE(test::eventually([&] { return rows() > before + 100; }));  // the first is not disturbed
    first.send(SIGTERM);
    EXPECT_EQ(first.wait(), 0);
    EXPECT_EQ(test::read_text(in("first.err")), "");
}

TEST_F(Pty, InfoIdentifiesTheDevice) {
    plug_in("--duration 4 --serial 4711 --mux fdm --rate-hz 960", "100000");
    ASSERT_EQ(tricoil("device info --json " + device), 0) << err;
    const json info = json::parse(out);
    EXPECT_EQ(info["serial"], 4711);
    EXPECT_EQ(info["role"], "front end");
    EXPECT_EQ(info["multiplexing"], "fdm");
    EXPECT_EQ(info["frame_rate_hz"], 960);
    EXPECT_EQ(info["drives_coils"], true);
    ASSERT_EQ(tricoil("device info " + device), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("serial         4711\n"));
    EXPECT_THAT(out, ::testing::HasSubstr("watchdog_s     0.1\n"));
}

TEST_F(Pty, WatchPrintsEveryMessageAndStartsNothing) {
    plug_in("--duration 4 --serial 18446744073709551615");
    ASSERT_EQ(tricoil("device watch --json --duration 0.6 " + device), 0) << err;
    int statuses = 0;
    bool identified = false;
    for (const std::string& line : test::lines(out)) {
        const json message = json::parse(line);
        identified = identified || (message["message"] == "identify" && message["serial"] == 18446744073709551615U);
        statuses += message["message"] == "status" && message["device_state"] == 0 ? 1 : 0;
    }
    EXPECT_TRUE(identified) << out;
    EXPECT_GE(statuses, 2) << out;
    ASSERT_EQ(tricoil("device watch --duration 0.3 " + device), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("status      sequence="));
}

TEST_F(Pty, SelfcheckReportsTheDevicesRows) {
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("selfcheck --json"), 0) << err;
    const json here = json::parse(out);
    ASSERT_EQ(tricoil("selfcheck --json --device " + device), 0) << err;
    const json there = json::parse(out);
    EXPECT_EQ(there["passed"], true);
    ASSERT_EQ(there["checks"].size(), here["checks"].size());
    for (std::size_t i = 0; i < here["checks"].size(); ++i) {
        EXPECT_EQ(there["checks"][i]["id"], here["checks"][i]["id"]);
        EXPECT_EQ(there["checks"][i]["what"], here["checks"][i]["what"]);
        EXPECT_EQ(there["checks"][i].value("limit", 0.0), here["checks"][i].value("limit", 0.0));
    }
}

TEST_F(Pty, SelfcheckEndsWithOneIfARowFailedThere) {
    plug_in("--duration 4 --fail-self-check");
    EXPECT_EQ(tricoil("selfcheck --json --device " + device), 1) << err;
    const json there = json::parse(out);
    EXPECT_EQ(there["passed"], false);
    EXPECT_EQ(there["checks"].back()["outcome"], "fail");
    EXPECT_EQ(tricoil("selfcheck --device " + device), 1);
    EXPECT_THAT(out, ::testing::HasSubstr("1 failed: FAIL"));
}

TEST_F(Pty, ModeIsSetAndPrinted) {
    plug_in("--duration 4 --tracks");
    ASSERT_EQ(tricoil("device mode --mux fdm --rate-hz 960 --columns " + device), 0) << err;
    EXPECT_EQ(out, device + ": front end, fdm, 960 frames a second\n");
    ASSERT_EQ(tricoil("run --json --device " + device + " --duration 0.5 --out " + in("poses.csv")), 0) << err;
    EXPECT_GT(test::lines(test::read_text(in("poses.csv"))).size(), 300U);
    EXPECT_EQ(tricoil("device mode --rate-hz 960 " + device), 3) << "TDM does not reach 960 frames/s";
    EXPECT_THAT(err, ::testing::HasSubstr("this mode: refused: invalid value"));
    EXPECT_EQ(tricoil("device mode --mux both " + device), 2);
    EXPECT_EQ(tricoil("device mode --rate-hz -1 " + device), 2);
}

TEST_F(Pty, BoresightAndHemisphereActOnATrackerBoard) {
    plug_in("--duration 600 --tracks --scenario still");
    ASSERT_EQ(tricoil("device boresight " + device), 0) << err;
    ASSERT_EQ(tricoil("device hemisphere --towards -1,0,0 " + device), 0) << err;
    ASSERT_EQ(tricoil("run --device " + device + " --duration 0.5 --out " + in("poses.csv")), 0) << err;
    const auto poses = table(in("poses.csv"));
    ASSERT_GT(poses.rows(), 10U);
    EXPECT_LT(poses.number(poses.rows() - 1, "x_m"), 0);
    EXPECT_EQ(tricoil("device hemisphere --towards 1,2 " + device), 2);
    EXPECT_EQ(tricoil("device hemisphere --towards nan,0,0 " + device), 2);
    ASSERT_EQ(tricoil("device boresight --clear " + device), 0) << err;
}

TEST_F(Pty, AFrontEndRefusesHemisphereAndBoresight) {
    plug_in("--duration 4");
    EXPECT_EQ(tricoil("device hemisphere --towards 1,0,0 " + device), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("this hemisphere: refused"));
    EXPECT_EQ(tricoil("device boresight --clear " + device), 3);
}

TEST_F(Pty, LoaderEndsTheProtocol) {
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("device loader " + device), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("in the boot loader"));
    EXPECT_EQ(tricoil("device info --wait 0.3 " + device), 3);
}

TEST_F(Pty, ACalibrationIsWrittenReadAndKept) {
    calibration::Calibration<double> c;
    c.model.source_moment *= 7e-3;
    c.phase_rad = Vec3<double>(0.01, -0.02, 0.03);
    const auto blob = calibration::encode(c);
    std::ofstream(in("cal.bin"), std::ios::binary).write(reinterpret_cast<const char*>(blob.data()), std::ssize(blob));
    plug_in("--duration 4 --calibration " + in("flash"));
    EXPECT_EQ(tricoil("device read-calibration --out " + in("got.bin") + " " + device), 1);
    EXPECT_THAT(err, ::testing::HasSubstr("the device has no calibration"));
    ASSERT_EQ(tricoil("device write-calibration " + device + " " + in("cal.bin")), 0) << err;
    ASSERT_EQ(tricoil("device read-calibration --out " + in("got.bin") + " " + device), 0) << err;
    EXPECT_EQ(test::read_text(in("got.bin")), test::read_text(in("cal.bin")));
    peer->send(SIGTERM);
    peer->wait();
    plug_in("--duration 4 --calibration " + in("flash"));
    ASSERT_EQ(tricoil("device read-calibration --out " + in("again.bin") + " " + device), 0) << err;
    EXPECT_EQ(test::read_text(in("again.bin")), test::read_text(in("cal.bin")));

    std::string damaged = test::read_text(in("cal.bin"));
    damaged[100] = static_cast<char>(damaged[100] ^ 1);
    test::write_text(in("bad.bin"), damaged);
    EXPECT_EQ(tricoil("device write-calibration " + device + " " + in("bad.bin")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("bad.bin: "));
    EXPECT_EQ(tricoil("device write-calibration " + device + " " + in("nothing.bin")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cannot be read"));
}

TEST_F(Pty, CapturedBlocksDemodulateToASensor) {
    plug_in("--duration 4 --scenario still");
    ASSERT_EQ(tricoil("device capture --repeats 3 --out " + in("capture.csv") + " " + device), 0) << err;
    const std::string next = test::lines(out).at(1);  // the command to paste
    ASSERT_TRUE(next.starts_with("tricoil demodulate " + in("capture.csv") + " --rate-hz 144000 ")) << next;
    ASSERT_EQ(tricoil(next.substr(8) + " --json"), 0) << err;
    const json analysis = json::parse(out);
    EXPECT_EQ(analysis["sensor_present"], true);
    EXPECT_EQ(analysis["repeats"], 3);
    EXPECT_GT(analysis["determinant"], 0);
}

TEST_F(Pty, NextCommandOfACaptureQuotesItsFile) {
    plug_in("--duration 4 --scenario still");
    const std::string file = in("it's a capture.csv");
    ASSERT_EQ(tricoil("device capture --out \"" + file + "\" " + device), 0) << err;
    ASSERT_EQ(tricoil(test::lines(out).at(1).substr(8)), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("signal matrix"));
}

TEST_F(Pty, NextCommandOfACaptureWithFdmSelectsTdm) {
    plug_in("--duration 4 --scenario still --mux fdm");
    ASSERT_EQ(tricoil("device capture --repeats 1 --out " + in("capture.csv") + " " + device), 0) << err;
    EXPECT_THAT(test::lines(out).at(1), ::testing::HasSubstr("run tricoil device mode " + device + " --mux tdm,"));
}

TEST_F(Pty, SilenceEndsWithOneLine) {
    plug_in("--duration 600");
    peer->send(SIGSTOP);
    EXPECT_EQ(tricoil("device info --wait 0.3 " + device), 3);
    EXPECT_EQ(err, "tricoil: " + device + ": identify: no answer yet\n");
    EXPECT_EQ(tricoil("selfcheck --wait 0.3 --device " + device), 3);
    EXPECT_EQ(tricoil("device watch --duration 0.3 " + device), 3);
    EXPECT_EQ(tricoil("device info serial:" + in("nothing")), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("cannot be opened"));
    EXPECT_EQ(tricoil("device info fax:1"), 2);
    EXPECT_EQ(tricoil("device"), 2);
    EXPECT_EQ(tricoil("device watch --duration -1 " + device), 2);
}

TEST_F(Pty, ListIsAlwaysJson) {
    ASSERT_EQ(tricoil("device list --json"), 0) << err;
    EXPECT_TRUE(json::parse(out).is_array());
    ASSERT_EQ(tricoil("device list"), 0) << err;
    EXPECT_FALSE(out.empty());
}

std::string vector_text(const Vec3<double>& v) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "[%.17g, %.17g, %.17g]", v(0), v(1), v(2));
    return text.data();
}
std::string matrix_text(const Mat3<double>& m) {
    std::string text = "[";
    for (int i = 0; i < 3; ++i) {
        text += vector_text(m.row(i)) + (i < 2 ? ", " : "]");
    }
    return text;
}

TEST_F(Pty, TheConfigurationsCalibrationReachesTheTracker) {
    // The simulated coils are ideal: a calibration with rotated coils must rotate the poses.
    const Mat3<double> turn = Eigen::AngleAxisd(0.4, Vec3<double>(1, 2, -1).normalized()).toRotationMatrix();
    const auto board = [&](const std::string& calibration) {
        test::write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
        test::write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n" + calibration);
    };
    const std::string sensor = "[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n";
    plug_in("--duration 4");
    board("[source]\nmoment = " + matrix_text(6.75e-3 * turn) + "\n" + sensor);
    ASSERT_EQ(tricoil("run --config " + in("board.toml") + " --duration 1 --out " + in("turned.csv")), 0) << err;
    peer->send(SIGTERM);
    peer->wait();
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("run --device " + device + " --duration 1 --out " + in("plain.csv")), 0) << err;
    const auto turned = table(in("turned.csv"));
    const auto plain = table(in("plain.csv"));
    const auto plain_rows = valid_rows(plain);
    std::size_t compared = 0;
    double worst_um = 0;
    for (const auto& [time_us, row] : valid_rows(turned)) {
        if (const auto other = plain_rows.find(time_us); other != plain_rows.end()) {
            worst_um = std::max(worst_um, 1e6 * (position_m(turned, row) - turn * position_m(plain, other->second)).norm());
            ++compared;
        }
    }
    std::printf("calibration with rotated coils: %zu poses, at most %.2f um from the rotated poses\n", compared, worst_um);
    EXPECT_GT(compared, 600U);
    EXPECT_LT(worst_um, 1) << "rounding in the protocol";
}

TEST_F(Pty, ARecordingHoldsWhatWasMeasuredAndTheCalibration) {
    const Mat3<double> turn = Eigen::AngleAxisd(0.4, Vec3<double>::UnitZ()).toRotationMatrix();
    plug_in("--duration 4");
    test::write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
    test::write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n[source]\nmoment = " + matrix_text(6.75e-3 * turn) +
                                         "\n[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n");
    const std::string recording = in("recording");
    ASSERT_EQ(tricoil("run --config " + in("board.toml") + " --duration 1 --record " + recording + " --out " + in("poses.csv")),
              0)
        << err;
    const json description = json::parse(test::read_text(recording + "/recording.json"));
    EXPECT_DOUBLE_EQ(description["trackers"]["calibration"]["source_moment"][0][0], 6.75e-3 * turn(0, 0));
    EXPECT_EQ(description["source"]["calibration_file"], in("cal.toml"));
    const auto inputs = table(recording + "/inputs.csv");
    std::size_t column = 0;
    while (inputs.text(column, "kind") != "column") {
        ++column;
    }
    EXPECT_LT(std::abs(inputs.number(column, "in_phase_1")), 0.5)
        << "the measured coupling must be recorded, not that of ideal coils with C = 1";
    const auto recorded = table(recording + "/poses.csv");
    const auto delivered = table(in("poses.csv"));
    const auto recorded_rows = valid_rows(recorded);
    ASSERT_GT(recorded_rows.size(), 100U);
    for (const auto& [time_us, row] : valid_rows(delivered)) {
        ASSERT_TRUE(recorded_rows.contains(time_us));
        EXPECT_LT((position_m(recorded, recorded_rows.at(time_us)) - position_m(delivered, row)).norm(), 1e-6)
            << "all outputs must have the same coordinate frame";
    }
    EXPECT_EQ(tricoil("replay " + recording), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("bit for bit"));
}

TEST_F(Pty, TheTrackerPredictsByTheTimeOfTheOption) {
    plug_in("--duration 4");
    const std::string run = "run --device " + device + " --tracker scaat --predict 0.02 --duration 1 --record " + in("recording");
    ASSERT_EQ(tricoil(run), 0) << err;
    const json description = json::parse(test::read_text(in("recording/recording.json")));
    EXPECT_EQ(description["trackers"]["tracker"]["predict_ahead_us"], 20'000);
}

TEST_F(Pty, CalibrationsThatATrackerCannotTakeAreRefused) {
    const auto board = [&](const std::string& calibration) {
        test::write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
        test::write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n" + calibration);
    };
    const std::string sensor = "[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n";
    plug_in("--duration 4");
    Mat3<double> skewed = Mat3<double>::Identity();
    skewed(0, 1) = 0.05;
    board("[source]\nmoment = " + matrix_text(skewed) + "\n" + sensor);
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml: source coils are not orthogonal"));
    board("[source]\nmoment = " + matrix_text(Mat3<double>::Identity()) +
          "\noffset_m = " + matrix_text(0.01 * Mat3<double>::Identity()) + "\n" + sensor);
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("coil offsets exceed 0.5 mm; use --tracker scaat for such coils"));
    EXPECT_NE(tricoil("run --tracker scaat --duration 1 --config " + in("board.toml")), 2) << err;
    test::write_text(in("cal.toml"), "nonsense\n");
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml"));
    EXPECT_EQ(test::lines(err).size(), 1U) << err;
    std::filesystem::remove(in("cal.toml"));
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml"));
}

}  // namespace
}  // namespace tricoil
