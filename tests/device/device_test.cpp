// `tricoil run --device` against the simulated front end in a process of its own, on the kernel's CAN, USB and GPIO: the same
// poses as in one process, and recovery from every fault without a wrong valid pose.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "core/calibration/blob.hpp"
#include "core/geometry/angles.hpp"
#include "tests/device/device_fixture.hpp"
#include "tests/device/loaded_bus.hpp"

namespace tricoil {
namespace {

using nlohmann::json;
using test::Device;
using test::judge;
using test::Judged;
using test::kFrontEnd;
using test::kTricoil;
using test::kWrongMm;
using test::Program;

TEST_F(Device, TracksOverCanToTheLastBitWithoutLoss) {
    Program peer(front_end("--duration 6"));
    Program tracker(tricoil("--device can:vcan0 --duration 4"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    test::expect_equal_poses("/run/poses.csv", {}, 4, 2800);
    const json s = summary();
    EXPECT_EQ(s["columns_lost"], 0);
    EXPECT_EQ(s["receive_dropped"], 0);
    EXPECT_GE(s["columns"], 4 * 720 - 3);
    std::printf("latency from the frame's arrival: median %.0f us, 99 %% %.0f us, max %ld us\n",
                s["latency_us"]["median"].get<double>(), s["latency_us"]["p99"].get<double>(),
                s["latency_us"]["max"].get<long>());
}

TEST_F(Device, TracksOverUsbToTheLastBitWithoutLoss) {
    Program peer(kFrontEnd + " --link usbip: --duration 4 --report /run/report.json");
    Program tracker(tricoil("--device usb:1209:0001 --duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    test::expect_equal_poses("/run/poses.csv", {}, 2, 1400);
    EXPECT_EQ(summary()["columns_lost"], 0);
}

TEST_F(Device, TracksFdmAtNineHundredAndSixtyFrames) {
    sim::FrontEndParams params;
    params.multiplexing = signal::Multiplexing::fdm;
    params.frame_rate_hz = 960;
    Program peer(front_end("--mux fdm --rate-hz 960 --duration 4"));
    Program tracker(tricoil("--device can:vcan0 --duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    test::expect_equal_poses("/run/poses.csv", params, 2, 1900);
    EXPECT_EQ(summary()["columns_lost"], 0);
}

/// The front end does not wait: columns that the host does not read in time are lost.
TEST_F(Device, LosesNothingAtTheFrontEndsOwnPace) {
    Program peer(front_end("--pace real --watchdog-us 3000000 --duration 20"));
    Program tracker(tricoil("--device can:vcan0 --duration 4"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    const json s = summary();
    EXPECT_EQ(s["columns_lost"], 0);
    EXPECT_EQ(s["receive_dropped"], 0);
    EXPECT_EQ(s["starts"], 1);
    std::printf("%d columns at the front end's own pace\n", s["columns"].get<int>());
}

TEST_F(Device, LostColumnsAreCounted) {
    const json s = run_with("--fault drop@100-110 --fault drop@400");
    EXPECT_EQ(s["columns_lost"], 12);
    EXPECT_EQ(s["starts"], 1);
}

TEST_F(Device, ReorderedAndDoubledColumnsAreRefused) {
    const json s = run_with("--fault swap@200 --fault swap@300 --fault twice@500-504");
    EXPECT_EQ(s["refused"]["out_of_order"], 7);
    EXPECT_EQ(s["starts"], 1);
}

TEST_F(Device, DamagedMessagesAreRefusedByKindAndReportedOncePerSecond) {
    const json s = run_with("--fault truncate@100-119 --fault corrupt@200-219 --fault version@300-319 --fault type@400-419");
    EXPECT_EQ(s["refused"]["wrong_length"], 20);
    EXPECT_EQ(s["refused"]["impossible"], 20);
    EXPECT_EQ(s["refused"]["unknown_version"], 20);
    EXPECT_EQ(s["starts"], 1);
    for (const char* what : {"wrong length", "values out of range", "unknown protocol version"}) {
        const std::string text = complaints();
        const auto first = text.find(what);
        ASSERT_NE(first, std::string::npos) << what;
    }
    EXPECT_LT(test::lines(complaints()).size(), 12U);
}

TEST_F(Device, ColumnsAcrossATransitionAreRefused) {
    const json s = run_with("--fault transition@100-149");
    EXPECT_EQ(s["refused"]["transition"], 50);
}

TEST_F(Device, ASilentFrontEndIsStartedAgain) {
    const json s = run_with("--fault silence@300-400", 2);
    EXPECT_GE(s["silences"], 1);
    EXPECT_GE(s["starts"], 2);
}

TEST_F(Device, TwoDevicesAtOneAddressAreNotTrusted) {
    Program peer(front_end("--duration 6 --fault second_device@0-1000000"));
    Program tracker(tricoil("--device can:vcan0 --duration 1 --wait 2"));
    EXPECT_EQ(tracker.wait(), 3);
    EXPECT_THAT(complaints(),
                ::testing::HasSubstr("devices 1 and 2 answer to one address; give one of them another node number"));
    EXPECT_EQ(judge("/run/poses.csv").valid, 0U);
}

TEST_F(Device, TheLinkGoesDownAndUp) {
    Program peer(front_end("--pace real --duration 20"));
    Program tracker(tricoil("--device can:vcan0 --duration 3"));
    for (int i = 0; i < 3; ++i) {
        test::pause_ms(400);
        test::shell("ip link set vcan0 down; sleep 0.2; ip link set vcan0 up");
    }
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_GE(summary()["link_losses"], 1);
}

TEST_F(Device, TheControllerGoesBusOffAndRestarts) {
    Program peer(front_end("--duration 20"));
    Program tracker(tricoil("--device can:vcan0 --duration 3"));
    ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; })) << complaints();
    test::shell("cansend vcan0 20000040#0000000000000000; sleep 0.1; cansend vcan0 20000100#0000000000000000");
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_GE(summary()["link_faults"], 1);
}

TEST_F(Device, ForeignTrafficLoadsTheBusToNineTenths) {
    test::LoadedBus bus("vcan0", 0.92, 720);
    Program peer(front_end("--duration 6"));
    Program tracker(tricoil("--device can:vcan0 --duration 3"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    bus.stop();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_EQ(summary()["columns_lost"], 0);
    EXPECT_EQ(summary()["receive_dropped"], 0);
    EXPECT_EQ(summary()["starts"], 1);
    std::printf("bus load %.1f %% at 500 kbit/s and 2 Mbit/s, without stuff bits: %lu foreign frames beside %lu of ours\n",
                100 * bus.load(), static_cast<unsigned long>(bus.foreign()), static_cast<unsigned long>(bus.ours()));
    EXPECT_GE(bus.load(), 0.9);
}

TEST_F(Device, TheFrontEndRestarts) {
    auto peer = std::make_unique<Program>(front_end("--duration 60"));
    Program tracker(tricoil("--device can:vcan0 --duration 3"));
    for (int i = 0; i < 2; ++i) {
        ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; }));
        peer->send(SIGKILL);
        peer->wait();
        peer = std::make_unique<Program>(front_end("--duration 60"));
        test::pause_ms(900);
    }
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_GE(summary()["starts"], 2);
}

TEST_F(Device, TheUsbPlugIsPulledFiftyTimes) {
    // A third of a second between replugs: several times the delay of poses through the kernel's USB, which depends on its
    // version.
    Program peer(kFrontEnd + " --link usbip: --duration 1 --replug 240 --replug-times 50 --report /run/report.json");
    Program tracker(tricoil("--device usb:1209:0001 --confined --hemisphere 1,0,0"));
    ASSERT_EQ(peer.wait(), 0) << complaints();  // the front end measured again after the last replug
    tracker.send(SIGTERM);
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    const Judged judged = judge("/run/poses.csv");
    EXPECT_GT(judged.valid, 50U * 120);
    EXPECT_LT(judged.worst_mm, kWrongMm);
    EXPECT_GE(summary()["link_losses"], 50);
    EXPECT_EQ(summary()["starts"], 51);
    std::printf("unplugged %d times, %zu valid poses, at most %.1f mm off\n", summary()["link_losses"].get<int>(), judged.valid,
                judged.worst_mm);
}

TEST_F(Device, RecoversFromAUsbStall) {
    Program peer(kFrontEnd + " --link usbip: --duration 6 --stall 20 --report /run/report.json");
    Program tracker(tricoil("--device usb:1209:0001 --duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_GE(summary()["link_faults"], 20);
    EXPECT_EQ(summary()["columns_lost"], 0);
}

TEST_F(Device, ListShowsTheInterfacesOfTheMachine) {
    Program peer(kFrontEnd + " --link usbip: --duration 600");
    json found;
    EXPECT_TRUE(test::eventually([&] {
        if (std::system((kTricoil + " device list --json > /run/list.json").c_str()) != 0) {
            return false;
        }
        found = json::parse(test::read_text("/run/list.json"));
        return found.size() == 3;
    })) << found;
    EXPECT_EQ(found, json::parse(R"([{"uri": "can:vcan0", "fd": true}, {"uri": "can:vcan1", "fd": false},
                                     {"uri": "usb:1209:0001:SIM0001", "product": "simulated front end"}])"));
    test::shell(kTricoil + " device list > /run/list.txt");
    EXPECT_THAT(test::read_text("/run/list.txt"), ::testing::HasSubstr("classic CAN; messages need CAN FD"));
}

TEST_F(Device, RequestsAreAnsweredOverCanAndUsb) {
    const std::string blob = "/run/calibration.bin";
    const auto bytes = calibration::encode(calibration::Calibration<double>{});
    test::write_text(blob, std::string(bytes.begin(), bytes.end()));
    const std::map<std::string, std::string> links{{"can:vcan0", "can:vcan0"}, {"usbip:", "usb:1209:0001"}};
    for (const auto& [link, device] : links) {
        Program peer(kFrontEnd + " --link " + link + " --serial 77 --duration 600");
        ASSERT_TRUE(test::eventually([&, d = device] {
            return std::system((kTricoil + " device info --json " + d + " > /run/info.json 2>/run/tricoil.err").c_str()) == 0;
        })) << complaints();
        EXPECT_EQ(json::parse(test::read_text("/run/info.json"))["serial"], 77);
        test::shell(kTricoil + " selfcheck --json --device " + device + " > /run/check.json");
        const json check = json::parse(test::read_text("/run/check.json"));
        EXPECT_EQ(check["passed"], true);
        EXPECT_GT(check["checks"].size(), 40U) << device;
        test::shell(kTricoil + " device write-calibration " + device + " " + blob);
        test::shell(kTricoil + " device read-calibration --out /run/got.bin " + device + "; cmp /run/got.bin " + blob);
        test::shell(kTricoil + " device capture --repeats 2 --out /run/capture.csv " + device);
        EXPECT_EQ(test::lines(test::read_text("/run/capture.csv")).size(), 1U + 2 * 3 * 200) << device;
        test::shell(kTricoil + " device watch --json --duration 0.5 " + device + " > /run/watch.json");
        EXPECT_THAT(test::read_text("/run/watch.json"), ::testing::HasSubstr("\"message\":\"status\""));
    }
}

TEST_F(Device, QueriesDuringARunAreRefused) {
    Program peer(front_end("--pace real --duration 600 --watchdog-us 5000000"));
    Program tracker(tricoil("--device can:vcan0"));
    ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; })) << complaints();
    test::shell(kTricoil + " device watch --json --duration 0.5 can:vcan0 > /run/watch.json");
    EXPECT_THAT(test::read_text("/run/watch.json"), ::testing::HasSubstr("\"message\":\"column\""));
    for (const char* question : {" selfcheck --device can:vcan0", " device capture --out /run/capture.csv can:vcan0"}) {
        EXPECT_NE(std::system((kTricoil + question + " > /run/none 2> /run/asked.err").c_str()), 0);
        EXPECT_THAT(test::read_text("/run/asked.err"), ::testing::HasSubstr("refused: the device measures for another program"));
    }
    tracker.send(SIGTERM);
    ASSERT_EQ(tracker.wait(), 0);
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_EQ(summary()["columns_lost"], 0);
    EXPECT_EQ(summary()["starts"], 1);
}

TEST_F(Device, AWatcherDoesNotKeepTheCoilsOn) {
    Program peer(front_end("--duration 600"));
    Program tracker(tricoil("--device can:vcan0"));
    ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; })) << complaints();
    Program watcher(kTricoil + " device watch can:vcan0 > /run/watch.txt");
    ASSERT_TRUE(test::eventually([] { return !test::read_text("/run/watch.txt").empty(); })) << complaints();
    tracker.send(SIGKILL);
    tracker.wait();
    test::pause_ms(1000);
    watcher.send(SIGTERM);
    EXPECT_EQ(watcher.wait(), 0);
    peer.send(SIGTERM);
    peer.wait();
    EXPECT_EQ(report()["coils_on"], false);
    EXPECT_GE(report()["watchdogs"], 1);
}

TEST_F(Device, TakesRealTimePriorityAndLocksItsMemoryWhereAllowed) {
    test::write_text("/run/board.toml", "device = \"can:vcan0\"\n[realtime]\npriority = 50\nlock_memory = true\n");
    Program peer(front_end("--duration 600"));
    {
        Program tracker(tricoil("--config /run/board.toml"));
        ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; })) << complaints();
        const std::string pid = std::to_string(tracker.pid());
        test::shell("chrt -p " + pid + " > /run/schedule; grep VmLck /proc/" + pid + "/status > /run/locked");
        EXPECT_THAT(test::read_text("/run/schedule"), ::testing::HasSubstr("SCHED_FIFO"));
        EXPECT_THAT(test::read_text("/run/schedule"), ::testing::HasSubstr("priority: 50"));
        EXPECT_THAT(test::read_text("/run/locked"), ::testing::Not(::testing::HasSubstr(" 0 kB")));
        tracker.send(SIGTERM);
        EXPECT_EQ(tracker.wait(), 0);
        EXPECT_EQ(summary()["memory_locked"], true);
        EXPECT_EQ(summary()["fifo"], true);
        EXPECT_EQ(complaints().find("poses may come late"), std::string::npos);
    }
    test::shell("chmod 777 /run");
    std::filesystem::remove("/run/poses.csv");
    std::filesystem::copy_file(kTricoil, "/run/tricoil");  // nobody may be locked out of the build folder
    Program nobody(
        "setpriv --reuid 65534 --regid 65534 --clear-groups --bounding-set=-all sh -c 'ulimit -l 64; ulimit -r 0; exec "
        "/run/tricoil"
        " run --json --config /run/board.toml --duration 1 --out /run/poses.csv' >/run/tricoil.out 2>/run/tricoil.err");
    EXPECT_EQ(nobody.wait(), 0) << complaints();
    EXPECT_EQ(summary()["memory_locked"], false);
    EXPECT_EQ(summary()["fifo"], false);
    EXPECT_THAT(complaints(), ::testing::HasSubstr("memory is not locked ("));
    EXPECT_THAT(complaints(), ::testing::HasSubstr("no real-time priority 50 (Operation not permitted)"));
    EXPECT_GT(judge("/run/poses.csv").valid, 600U) << "it must track without real-time priority";
}

TEST_F(Device, MissingOrInvalidDeviceEndsWithOneLine) {
    const std::map<std::string, std::pair<int, std::string>> cases{
        {"--device can:vcan9 --wait 0.3", {3, "vcan9: no such network interface"}},
        {"--device can:vcan1 --wait 0.3", {3, "classic CAN interface"}},
        {"--device can:vcan0 --wait 0.3", {3, "can:vcan0: no answer yet"}},
        {"--device usb:1209:0001 --wait 0.3", {3, "not found; is it plugged in"}},
        {"--device serial:/dev/nothing --wait 0.3", {3, "/dev/nothing: cannot be opened"}},
        {"--device can:vcan0#16", {2, "'16' is not a valid node number, 0 to 15"}},
        {"--device usb:12:zz", {2, "'zz' is not a valid product number"}},
        {"--device tcp:host", {2, "unknown device 'tcp:host'"}},
        {"--device can:", {2, "unknown device 'can:'"}},
        {"--config /nothing.toml", {2, "/nothing.toml: cannot be opened"}},
    };
    for (const auto& [options, expected] : cases) {
        Program tracker(tricoil(options));
        EXPECT_EQ(tracker.wait(), expected.first) << options;
        EXPECT_THAT(complaints(), ::testing::HasSubstr(expected.second)) << options;
        EXPECT_LE(test::lines(complaints()).size(), 3U) << complaints();
    }
}

}  // namespace
}  // namespace tricoil
