// JSON lines over TCP and UDP, as a client receives them.
#include <gmock/gmock.h>

#include <chrono>
#include <sstream>

#include "board/pose_text/served_pose_line.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

using nlohmann::json;

std::vector<json> parsed(const std::string& text) {
    std::vector<json> poses;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line) && !lines.eof();) {  // without a last line that is cut
        poses.push_back(json::parse(line));
    }
    return poses;
}

/// Consecutive poses, 1/240 s apart, of the present time.
void expect_every_pose(const std::vector<json>& poses) {
    const double now_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    EXPECT_NEAR(poses.front()["utc_s"].get<double>(), now_s, 30);
    for (std::size_t n = 1; n < poses.size(); ++n) {
        ASSERT_EQ(poses[n]["sequence"].get<int>(), poses[n - 1]["sequence"].get<int>() + 1);
        ASSERT_NEAR(poses[n]["time_us"].get<double>() - poses[n - 1]["time_us"].get<double>(), 1e6 / 240, 2);
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
    const auto poses = parsed(read_for(client, std::chrono::seconds(30), 300'000));
    close(client);
    ASSERT_GT(poses.size(), 500U);
    expect_every_pose(poses);
}

TEST(JsonLines, AUdpReceiverGetsOnePosePerDatagram) {
    const int receiver = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(bind(receiver, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);  // NOLINT: the sockets' way
    socklen_t size = sizeof address;
    getsockname(receiver, reinterpret_cast<sockaddr*>(&address), &size);  // NOLINT
    const Serving serving({"--json-lines", "udp:127.0.0.1:" + std::to_string(ntohs(address.sin_port)), "--scenario", "still"});
    std::vector<json> poses;
    while (poses.size() < 500) {
        const std::string datagram = read_for(receiver, std::chrono::seconds(10), 1);
        ASSERT_FALSE(datagram.empty());
        ASSERT_EQ(datagram.find('\n'), datagram.size() - 1);
        poses.push_back(json::parse(datagram));
    }
    close(receiver);
    expect_every_pose(poses);
}

TEST(JsonLines, AReceiverThatIsNotThereStopsNothing) {
    Serving serving({"--json-lines", "udp:127.0.0.1:9", "--json-lines", "tcp:0", "--scenario", "still", "--duration", "0.5"});
    EXPECT_EQ(serving.stop(0), 0);  // waits
}

TEST(JsonLines, ALineIsJsonForEveryPose) {
    host::ServedPose served{{}, host::utc_time_us(1'700'000'000'000'042)};
    served.pose.position_m.setConstant(std::nan(""));
    served.pose.flags = tracking::kAllPoseFlags;
    const json line = json::parse(host::served_pose_line(served));
    EXPECT_EQ(line["valid"], 0);
    EXPECT_TRUE(line["position_m"][0].is_null());
    EXPECT_DOUBLE_EQ(line["utc_s"].get<double>(), 1'700'000'000.000042);
    EXPECT_THAT(line["flag_names"].get<std::string>(), testing::HasSubstr("distorted"));
}

}  // namespace
}  // namespace tricoil::test
