// Coil lines that `tricoil run --device` switches on the kernel's simulated GPIO chip: in turn, never two at once, and off after
// every end of a run.
#include "tests/device/device_fixture.hpp"
#include "tests/drivers/gpio_trace.hpp"

namespace tricoil {
namespace {

using nlohmann::json;
using test::judge;
using test::kTricoil;
using test::kWrongMm;
using test::Program;

// On the emulated PC a busy machine may stop the test for some time. Tests of bit-exact poses therefore need a longer enable
// time, and time limits for switching off include 50 ms for it.
const std::string kPatientEnable = "--hold-ms 3000 --patience-ms 3000 --watchdog-us 3000000 ";
constexpr double kTurnMs = 50 + 15;
// The tools of libgpiod 2 have other options.
const bool kHasGpiod1 = std::system("gpioset --version | grep -q v1") == 0;

class Lines : public test::Device {
protected:
    static std::string config(const std::string& more = "") {
        test::write_text(
            "/run/board.toml",
            "device = \"can:vcan0\"\n[coils]\nchip = \"tracker-sim\"\ns1 = \"coil_s1\"\ns2 = \"coil_s2\"\ns3 = \"coil_s3\"\n"
            "heartbeat = \"heartbeat\"\n" +
                more);
        return "--config /run/board.toml ";
    }
    static std::string watched() { return "--gpio " + std::string(std::getenv("GPIO_SIM")) + " --heartbeat "; }
};

TEST_F(Lines, FollowTheStatesInTurnAndThePosesAreTheSame) {
    const test::GpioTrace trace;
    Program peer(front_end(watched() + kPatientEnable + "--duration 4 --linger-ms 500"));
    Program tracker(tricoil(config() + "--duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    test::expect_equal_poses("/run/poses.csv", {}, 2, 1400);
    const auto changes = trace.changes();
    EXPECT_GE(changes.size(), 2U * 1440);
    EXPECT_EQ(test::lines_on(changes).most, 1) << "two coils were on at the same time";
    EXPECT_EQ(test::lines_on(changes).at_end, 0) << "a coil was on at the exit";
    test::pause_ms(100);
    peer.send(SIGTERM);
    peer.wait();
    const json gpio = report()["gpio"];
    EXPECT_GE(gpio["turned_on"], 1440);
    EXPECT_EQ(gpio["several_on"], 0);
    EXPECT_EQ(gpio["out_of_turn"], 0);
    EXPECT_EQ(report()["transitions"], 0);
}

TEST_F(Lines, FollowTheSyncLine) {
    Program peer(front_end(watched() + kPatientEnable + "--sync --duration 4 --linger-ms 500"));
    Program tracker(tricoil(config("sync = \"sync\"\n") + "--duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    test::expect_equal_poses("/run/poses.csv", {}, 2, 1400);
    const json s = summary();
    EXPECT_GE(s["sync_edges"], 1440);
    EXPECT_GE(s["excitations"], 1440);
    EXPECT_LE(s["excitations"], s["sync_edges"].get<int>() + 1) << "one at the start, then one for each edge";
    EXPECT_EQ(s["columns_lost"], 0);
    test::pause_ms(100);
    peer.send(SIGTERM);
    peer.wait();
    EXPECT_EQ(report()["gpio"]["several_on"], 0);
    EXPECT_EQ(report()["gpio"]["out_of_turn"], 0);
    EXPECT_EQ(report()["transitions"], 0);
}

TEST_F(Lines, AColumnThatEchoesAnotherStateIsRefused) {
    Program peer(
        front_end(watched() + kPatientEnable + "--duration 4 --fault wrong_sequence@100-119 --fault wrong_coil@300-319"));
    Program tracker(tricoil(config() + "--duration 2"));
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
    EXPECT_EQ(summary()["refused"]["transition"], 40);
    EXPECT_EQ(summary()["starts"], 1);
    EXPECT_THAT(complaints(), ::testing::HasSubstr("measured while the coils changed"));
}

TEST_F(Lines, ColumnsMeasuredWhileTheHostWasAwayAreRefused) {
    Program peer(front_end(watched() + "--hold-ms 2000 --watchdog-us 2000000 --duration 60"));
    Program tracker(tricoil(config()));
    ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 100; })) << complaints();
    tracker.send(SIGSTOP);  // the front end waits for the host to switch the coil, then measures in any case
    test::pause_ms(450);
    tracker.send(SIGCONT);
    test::pause_ms(300);
    tracker.send(SIGTERM);
    ASSERT_EQ(tracker.wait(), 0) << complaints();
    peer.send(SIGTERM);
    peer.wait();
    EXPECT_GE(report()["transitions"], 1);
    EXPECT_GE(summary()["refused"]["transition"], 1);
    EXPECT_LT(judge("/run/poses.csv").worst_mm, kWrongMm);
}

TEST_F(Lines, AreOffAfterSigtermAndTheEnableDropsAfterSigkill) {
    for (const int signal : {SIGTERM, SIGINT, SIGQUIT, SIGHUP, SIGKILL}) {
        const test::GpioTrace trace;
        std::filesystem::remove("/run/poses.csv");
        Program peer(front_end(watched() + "--duration 60 --watchdog-us 60000"));
        Program tracker(tricoil(config()));
        ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 50; })) << complaints();
        tracker.send(signal);
        EXPECT_EQ(tracker.wait(), signal == SIGKILL ? 128 + SIGKILL : 0);
        test::pause_ms(500);
        peer.send(SIGTERM);
        peer.wait();
        const json r = report();
        EXPECT_EQ(r["gpio"]["enabled_at_end"], false) << signal;
        EXPECT_EQ(r["coils_on"], false);
        if (signal == SIGKILL) {
            EXPECT_GE(r["watchdogs"], 1);
            EXPECT_LT(r["coils_off_after_ms"], 60 + kTurnMs);
            EXPECT_LT(r["gpio"]["enable_dropped_after_ms"], 47 + kTurnMs);
            std::printf("killed: front end off after %.1f ms, enable dropped after %.1f ms\n",
                        r["coils_off_after_ms"].get<double>(), r["gpio"]["enable_dropped_after_ms"].get<double>());
        } else {
            EXPECT_EQ(test::lines_on(trace.changes()).at_end, 0) << signal;
        }
        test::shell(kHasGpiod1 ? "gpioset tracker-sim 0=0 1=0 2=0" : "gpioset --toggle 0 coil_s1=0 coil_s2=0 coil_s3=0");
    }
}

TEST_F(Lines, AreOffWhileTheDeviceIsAway) {
    const test::GpioTrace trace;
    Program peer(front_end(watched() + kPatientEnable + "--duration 60"));
    Program tracker(tricoil(config()));
    ASSERT_TRUE(test::eventually([] { return test::lines(test::read_text("/run/poses.csv")).size() > 50; })) << complaints();
    peer.send(SIGKILL);
    peer.wait();
    test::pause_ms(100);  // until its last columns are read: from one coil to the next all are off for a moment
    EXPECT_TRUE(test::eventually([&] { return test::lines_on(trace.changes()).at_end == 0; })) << complaints();
    tracker.send(SIGTERM);
    EXPECT_EQ(tracker.wait(), 0) << "the program looked for the device: " << complaints();
}

TEST_F(Lines, AreOffAfterEveryEndOfTheOutput) {
    const auto ends = [&](const std::string& command, bool by_signal, const std::string& what) {
        const test::GpioTrace trace;
        Program peer(front_end(watched() + kPatientEnable + "--pace real --duration 60"));
        Program tracker(command);
        if (by_signal) {
            EXPECT_TRUE(test::eventually([&] { return trace.changes().size() > 100; })) << what;
            test::pause_ms(3000);
            test::shell("pkill -TERM -x tricoil");
            EXPECT_TRUE(test::eventually([] { return std::system("pgrep -x tricoil >/dev/null") != 0; })) << what;
            test::shell("pkill -x sleep");
        }
        tracker.wait();
        EXPECT_TRUE(test::eventually([] { return std::system("pgrep -x tricoil >/dev/null") != 0; })) << what;
        const auto changes = trace.changes();
        EXPECT_GT(changes.size(), 100U) << what;
        EXPECT_EQ(test::lines_on(changes).at_end, 0) << what;
        peer.send(SIGTERM);
        peer.wait();
    };
    const std::string run = kTricoil + " run --json " + config();
    ends("sh -c '" + run + "2>/dev/null | head -n 200 >/dev/null'", false, "a reader that goes away");
    ends("sh -c '" + run + "2>/dev/null | sleep 600'", true, "a reader that does not read, and SIGTERM");
    ends("sh -c 'ulimit -f 40; " + run + "--duration 2 --out /run/poses.csv >/dev/null 2>&1'", false,
         "a file that grows too long");
}

TEST_F(Lines, BusyLineExitsWith3) {
    Program holder(kHasGpiod1 ? "gpioset --mode=signal tracker-sim 1=0" : "gpioset coil_s2=0");
    test::pause_ms(100);
    Program tracker(tricoil(config()));
    EXPECT_EQ(tracker.wait(), 3);
    EXPECT_EQ(complaints(),
              "tricoil: GPIO line 'coil_s2' of 'tracker-sim' is in use by 'gpioset'; end that program, or choose another line\n");
}

}  // namespace
}  // namespace tricoil
