// JSON lines over TCP and UDP, as a client receives them.
#include <gmock/gmock.h>

#include <chrono>
#include <limits>
#include <sstream>

#include "board/pose_text/served_pose.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

using nlohmann::json;

/// Adds the pose of a line. Leaves out a stale pose, which the program sends if the machine pauses for half a second.
void add(const std::string& line, std::vector<json>& poses) {
    json pose = json::parse(line);
    if (pose["flag_names"].get<std::string>().find("stale") == std::string::npos) {
        poses.push_back(std::move(pose));
    }
}

std::vector<json> parsed(const std::string& text) {
    std::vector<json> poses;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line) && !lines.eof();) {  // without an incomplete last line
        add(line, poses);
    }
    return poses;
}

/// Poses of the present time, 1/240 s apart for consecutive sequence numbers. some_missing: numbers may be left out.
void expect_poses(const std::vector<json>& poses, bool some_missing) {
    const double now_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    EXPECT_NEAR(poses.front()["utc_s"].get<double>(), now_s, 30);
    for (std::size_t n = 1; n < poses.size(); ++n) {
        const int step = poses[n]["sequence"].get<int>() - poses[n - 1]["sequence"].get<int>();
        ASSERT_GE(step, 1);
        ASSERT_TRUE(step == 1 || some_missing) << step;
        ASSERT_NEAR(poses[n]["time_us"].get<double>() - poses[n - 1]["time_us"].get<double>(), step * 1e6 / 240, 2);
    }
    EXPECT_EQ(poses.back()["valid"], 1);
    EXPECT_EQ(poses.back()["flag_names"], "");
    EXPECT_NEAR(poses.back()["position_m"][0].get<double>(), 0.5, 1e-3);  // where the sensor of this scenario rests
}

TEST(JsonLines, ATcpClientReceivesEveryPose) {
    const Serving serving({"--json-lines", "tcp:0", "--scenario", "still"});
    const std::string address = serving.address("json_lines");
    const int client = connect_to(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    EXPECT_EQ(write(client, "what it sends is ignored\n", 25), 25);
    const auto poses = parsed(read_for(client, std::chrono::seconds(30), 350'000));
    close(client);
    ASSERT_GT(poses.size(), 500U);
    expect_poses(poses, false);
}

TEST(JsonLines, PosesAreThoseOfTheTip) {
    const Serving serving({"--json-lines", "tcp:0", "--scenario", "pointer", "--tip", "0.15,0,0.02"});
    const std::string address = serving.address("json_lines");
    const int client = connect_to(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    const auto poses = parsed(read_for(client, std::chrono::seconds(30), 100'000));
    close(client);
    ASSERT_GT(poses.size(), 100U);
    const std::vector<double> tip = poses.back()["position_m"];
    EXPECT_NEAR(tip[0], 0.6, 1e-3);  // where the tip of this scenario rests
    EXPECT_NEAR(tip[1], 0, 1e-3);
    EXPECT_NEAR(tip[2], 0, 1e-3);
}

TEST(JsonLines, AUdpReceiverGetsOnePosePerDatagram) {
    const UdpReceiver receiver;
    const Serving serving({"--json-lines", "udp:127.0.0.1:" + receiver.port(), "--scenario", "still"});
    std::vector<json> poses;
    while (poses.size() < 500) {
        const std::string datagram = receiver.datagram();
        ASSERT_FALSE(datagram.empty());
        ASSERT_EQ(datagram.find('\n'), datagram.size() - 1);
        add(datagram, poses);
    }
    expect_poses(poses, true);  // UDP may lose datagrams
}

TEST(JsonLines, StandardOutputContainsOnlyPoses) {
    const auto run = tricoil("serve --json-lines - --fastrak tcp:0 --scenario still --duration 2");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr("serving fastrak on"));
    const auto poses = parsed(run.out);
    EXPECT_GE(poses.size(), 470U);
    expect_poses(poses, false);
}

TEST(JsonLines, EndsWhenTheReaderOfStandardOutputHasGone) {
    const std::string lines = path_in_temp("lines");
    const std::string code = path_in_temp("code");
    (void)tricoil("serve --json-lines - --scenario still; echo $? >" + code + "; } | head -n 1 >" + lines + "; :", "{ :");
    EXPECT_EQ(parsed(read_file(lines)).size(), 1U);
    EXPECT_EQ(read_file(code), "0\n");
}

TEST(JsonLines, StandardOutputIsNotShared) {
    const auto run = tricoil("serve --json-lines - --json --scenario still");
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, testing::HasSubstr("--json-lines - and --json exclude each other"));
}

TEST(JsonLines, MissingReceiverStopsNothing) {
    const Serving serving({"--json-lines", "udp:127.0.0.1:9", "--fastrak", "tcp:0", "--scenario", "still"});
    const int client = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(client, "C", 1), 1);
    constexpr std::size_t kRecords = 100;
    EXPECT_GE(read_for(client, std::chrono::seconds(30), 47 * kRecords).size(), 47 * kRecords);
    close(client);
    EXPECT_EQ(serving.err(), "");
}

TEST(JsonLines, ALineIsJsonForEveryPose) {
    host::ServedPose served{{}, host::utc_time_us(1'700'000'000'000'042)};
    served.pose.position_m.setConstant(std::nan(""));
    served.pose.flags = tracking::kAllPoseFlags;
    const json line = json::parse(host::served_pose_line(served));
    EXPECT_EQ(line["valid"], 0);
    EXPECT_TRUE(line["position_m"].is_null());
    EXPECT_DOUBLE_EQ(line["utc_s"].get<double>(), 1'700'000'000.000042);
    served.pose.position_m.setConstant(std::numeric_limits<double>::max());
    served.pose.covariance.setConstant(std::numeric_limits<double>::max());
    EXPECT_DOUBLE_EQ(json::parse(host::served_pose_line(served))["position_m"][1].get<double>(),
                     std::numeric_limits<double>::max());
    EXPECT_THAT(line["flag_names"].get<std::string>(), testing::HasSubstr("distorted"));
}

}  // namespace
}  // namespace tricoil::test
