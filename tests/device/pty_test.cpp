// The program with the simulated front end on a pseudo terminal: tracking, and all commands of `tricoil device` and `tricoil
// selfcheck --device`. Needs no test kernel.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/posix/file_descriptor.hpp"
#include "tests/device/pty_fixture.hpp"

namespace tricoil::test {
namespace {

TEST_F(Pty, PosesAreRelativeToTheReference) {
    plug_in("--duration 10");
    ASSERT_EQ(tricoil("run --json --device " + device + " --duration 1 --relative-to 1 --out " + in("poses.csv")), 0) << err;
    const CsvTable own = table(in("poses.csv"));
    const auto rows = valid_rows(own);
    EXPECT_GT(rows.size(), 100U);
    for (const auto& [time, row] : rows) {
        EXPECT_EQ(own.number(row, "x_m"), 0);
        EXPECT_EQ(own.number(row, "std_x_m"), 0);
    }
    const json first = json::parse(lines(out).front());
    EXPECT_EQ(first["position_m"], json::array({0.0, 0.0, 0.0}));
    (void)tricoil("run --device " + device + " --duration 1 --relative-to 2 --out " + in("absent.csv"));
    EXPECT_GT(table(in("absent.csv")).rows(), 100U);
    EXPECT_TRUE(valid_rows(table(in("absent.csv"))).empty());  // the device has no second sensor
}

/// At once, not after the watchdog of five seconds.
TEST_F(Pty, CoilsAreOffAfterARun) {
    plug_in("--duration 20");
    ASSERT_EQ(tricoil("run --device " + device + " --duration 0.5 --out " + in("poses.csv")), 0) << err;
    ASSERT_EQ(tricoil("device watch --json --duration 0.5 " + device), 0) << err;
    int statuses = 0;
    for (const std::string& line : lines(out)) {
        const json message = json::parse(line);
        if (message["message"] == "status") {
            EXPECT_EQ(message["device_state"], 0) << line;
            ++statuses;
        }
    }
    EXPECT_GE(statuses, 2);
}

TEST_F(Pty, JsonLinesHoldPosesAlone) {
    plug_in("--duration 10");
    ASSERT_EQ(tricoil("run --json-lines - --device " + device + " --duration 1 --out " + in("poses.csv")), 0) << err;
    EXPECT_THAT(err, ::testing::HasSubstr("columns"));  // the summary
    const auto rows = lines(out);
    EXPECT_GT(rows.size(), 100U);
    for (const std::string& row : rows) {
        EXPECT_TRUE(json::parse(row).contains("utc_s"));
    }
    EXPECT_GT(table(in("poses.csv")).rows(), 100U);
}

TEST_F(Pty, AReaderThatDoesNotReadDoesNotKeepTheProgram) {
    plug_in("--duration 20");
    const std::string pipe = in("pipe");
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const drivers::FileDescriptor reader(::open(pipe.c_str(), O_RDWR | O_CLOEXEC));
    const std::string page(static_cast<std::size_t>(::fcntl(reader.get(), F_SETPIPE_SZ, 4096)), 'x');
    ASSERT_EQ(::write(reader.get(), page.data(), page.size()), static_cast<ssize_t>(page.size()));
    Program program(std::string(TRICOIL_PROGRAM) + " run --json --device " + device + " --duration 1 >" + pipe + " 2>" +
                    in("err"));
    EXPECT_EQ(program.wait(), 3);
    const std::string message = lines(read_text(in("err"))).back();
    const std::string start = "tricoil: standard output: ";
    ASSERT_TRUE(message.starts_with(start)) << message;
    EXPECT_GT(std::stoi(message.substr(start.size())), 400) << message;
    EXPECT_THAT(message, ::testing::EndsWith(" poses were dropped, because its reader is too slow"));
}

TEST_F(Pty, TracksBitForBitWithoutLoss) {
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("run --json --device " + device + " --duration 2 --out " + in("poses.csv")), 0) << err;
    expect_equal_poses(in("poses.csv"), {}, 2, 1400);
    const CsvTable poses = table(in("poses.csv"));
    EXPECT_GT(poses.number(poses.rows() - 1, "predicted_error_mm"), 0);
    const json summary = json::parse(lines(out).back());
    EXPECT_EQ(summary["columns_lost"], 0);
    EXPECT_EQ(summary["starts"], 1);
    EXPECT_EQ(summary["device"], device);
    EXPECT_EQ(summary["health"]["received"], summary["columns"]);
    EXPECT_EQ(summary["health"]["lost"], 0);
}

TEST_F(Pty, TracksInTwoBandsBitForBit) {
    plug_in("--mux dual-band --duration 4");
    sim::FrontEndParams params;
    params.multiplexing = signal::Multiplexing::dual_band;
    ASSERT_EQ(tricoil("run --json --tracker dual-band --device " + device + " --duration 2 --out " + in("poses.csv")), 0) << err;
    expect_equal_poses(in("poses.csv"), params, 2, 470);
}

TEST_F(Pty, TwoBandsNeedADeviceThatMeasuresThem) {
    plug_in("--duration 60");
    EXPECT_EQ(tricoil("run --wait 1 --tracker dual-band --device " + device), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("does not send columns of two bands; use 'tricoil device mode"));
    ASSERT_EQ(tricoil("device mode --mux dual-band --columns " + device), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("front end, dual-band, 240 frames a second"));
    EXPECT_EQ(tricoil("run --tracker dual-band --duration 0.5 --device " + device), 0) << err;
    ASSERT_EQ(tricoil("device mode --mux dual-band --columns --rate-hz 225 " + device), 0) << err;
    EXPECT_EQ(tricoil("run --tracker dual-band --duration 0.5 --device " + device), 0) << err;  // 45 frames are 0.2 s
    ASSERT_EQ(tricoil("device mode --mux dual-band --columns --rate-hz 144 " + device), 0) << err;
    EXPECT_EQ(tricoil("run --wait 1 --tracker dual-band --device " + device), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("hold a whole number of the device's frames"));
    EXPECT_EQ(tricoil("device mode --mux dual-band --columns --rate-hz 480 " + device), 3);  // fewer than two cycles
}

TEST_F(Pty, TheFrontEndEndsIfNoHostMeasures) {
    plug_in("--duration 60 --idle-s 1");
    EXPECT_EQ(peer->wait(), 0);
    const std::string report = read_text(in("line"));
    EXPECT_NE(report.find("\"slots\": 0"), std::string::npos) << report;
}

TEST_F(Pty, AVanishedLineIsReported) {
    plug_in("--duration 600");
    // A link, because other programs receive the number of a closed pseudo terminal.
    const std::string link = in("serial_line");
    std::filesystem::create_symlink(device.substr(device.find(':') + 1), link);
    Program tracker(std::string(TRICOIL_PROGRAM) + " run --device serial:" + link + " --out " + in("poses.csv") + " 2>" +
                    in("err") + " >" + in("out"));
    ASSERT_TRUE(eventually([&] { return lines(read_text(in("poses.csv"))).size() > 100; }));
    peer->send(SIGKILL);
    peer->wait();
    std::filesystem::remove(link);
    EXPECT_TRUE(eventually([&] { return read_text(in("err")).find("cannot be opened") != std::string::npos; }))
        << read_text(in("err"));
    tracker.send(SIGTERM);
    EXPECT_EQ(tracker.wait(), 0);
}

/// The device's clock stops with the device; the host's clock then ends the run.
TEST_F(Pty, ARunOfAVanishedDeviceEnds) {
    plug_in("--duration 600");
    const std::string link = in("serial_line");
    std::filesystem::create_symlink(device.substr(device.find(':') + 1), link);
    Program tracker(std::string(TRICOIL_PROGRAM) + " run --duration 3 --device serial:" + link + " --out " + in("poses.csv") +
                    " 2>" + in("err") + " >" + in("out"));
    ASSERT_TRUE(eventually([&] { return lines(read_text(in("poses.csv"))).size() > 100; }));
    peer->send(SIGKILL);
    peer->wait();
    std::filesystem::remove(link);
    EXPECT_EQ(tracker.wait(), 3);
    EXPECT_THAT(read_text(in("err")), ::testing::HasSubstr("s of --duration"));
}

TEST_F(Pty, SecondProgramGetsLineInUse) {
    plug_in("--duration 600");
    Program first(std::string(TRICOIL_PROGRAM) + " run --device " + device + " --out " + in("poses.csv") + " 2>" +
                  in("first.err") + " >" + in("first.out"));
    const auto rows = [&] { return lines(read_text(in("poses.csv"))).size(); };
    ASSERT_TRUE(eventually([&] { return rows() > 100; }));
    const std::string at_the_start = read_text(in("first.err"));  // on a busy machine it may have waited for an answer
    EXPECT_TRUE(at_the_start.empty() || at_the_start.find("no answer yet") != std::string::npos) << at_the_start;
    EXPECT_EQ(tricoil("run --wait 0.5 --duration 1 --device " + device), 3);
    EXPECT_THAT(err, ::testing::HasSubstr("another program uses it"));
    EXPECT_EQ(err.find("another program"), err.rfind("another program")) << "the reason is printed once: " << err;
    const auto before = rows();
    EXPECT_TRUE(eventually([&] { return rows() > before + 100; }));  // the first is not disturbed
    first.send(SIGTERM);
    EXPECT_EQ(first.wait(), 0);
    EXPECT_EQ(read_text(in("first.err")), at_the_start);
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
    for (const std::string& line : lines(out)) {
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

#ifdef TRICOIL_WITH_PYTHON
TEST_F(Pty, CapturedBlocksDemodulateToASensor) {
    plug_in("--duration 4 --scenario still");
    ASSERT_EQ(tricoil("device capture --repeats 3 --out " + in("capture.csv") + " " + device), 0) << err;
    const std::string next = lines(out).at(1);  // the command to paste
    ASSERT_TRUE(next.starts_with("tricoil demodulate " + in("capture.csv") + " --rate-hz 144000 ")) << next;
    ASSERT_EQ(tricoil(next.substr(8) + " --json"), 0) << err;
    const json analysis = json::parse(out);
    EXPECT_EQ(analysis["sensor_present"], true);
    EXPECT_EQ(analysis["repeats"], 3);
    EXPECT_GT(analysis["determinant"], 0);
    EXPECT_EQ(analysis["reference_channel"], 3);
}
#endif

/// Every code of the first block, in its channel.
TEST_F(Pty, CapturedCodesAreThoseOfTheConverters) {
    plug_in("--duration 4 --scenario still");
    ASSERT_EQ(tricoil("device capture --repeats 2 --out " + in("capture.csv") + " " + device), 0) << err;
    sim::FrontEndParams params;
    params.scenario = std::make_shared<sim::Scenario>(host::load_scenario("still", 1));
    sim::ColumnSource source(params);
    const auto block = source.sample(Excitation::s1);
    ASSERT_TRUE(block);
    const CsvTable captured = table(in("capture.csv"));
    ASSERT_GE(captured.rows(), block->samples.size());
    for (std::size_t n = 0; n < block->samples.size(); ++n) {
        ASSERT_EQ(captured.text(n, "state"), "S1");
        for (std::size_t c = 0; c < kChannels; ++c) {
            ASSERT_EQ(captured.text(n, "adc" + std::to_string(c)), std::to_string(block->samples[n][c])) << n;
        }
    }
}

TEST_F(Pty, NextCommandOfACaptureQuotesItsFile) {
    plug_in("--duration 4 --scenario still");
    const std::string file = in("it's a capture.csv");
    ASSERT_EQ(tricoil("device capture --out \"" + file + "\" " + device), 0) << err;
    ASSERT_EQ(tricoil(lines(out).at(1).substr(8)), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("signal matrix"));
}

TEST_F(Pty, NextCommandOfACaptureWithFdmSelectsTdm) {
    plug_in("--duration 4 --scenario still --mux fdm");
    ASSERT_EQ(tricoil("device capture --repeats 1 --out " + in("capture.csv") + " " + device), 0) << err;
    EXPECT_THAT(lines(out).at(1), ::testing::HasSubstr("run tricoil device mode " + device + " --mux tdm,"));
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

TEST_F(Pty, TheTrackerPredictsByTheTimeOfTheOption) {
    plug_in("--duration 4");
    const std::string run = "run --device " + device + " --tracker scaat --predict 0.02 --duration 1 --record " + in("recording");
    ASSERT_EQ(tricoil(run), 0) << err;
    const json description = json::parse(read_text(in("recording/recording.json")));
    EXPECT_EQ(description["trackers"]["tracker"]["predict_ahead_us"], 20'000);
}

}  // namespace
}  // namespace tricoil::test
