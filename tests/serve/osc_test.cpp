// Poses as Open Sound Control bundles: their bytes, by the rules of OSC 1.0, and the option of the program.
#include <gmock/gmock.h>

#include <bit>
#include <cstring>
#include <map>

#include "board/pose_text/osc/osc_bundle.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

/// Reader of the bytes of a bundle.
class OscBytes {
public:
    explicit OscBytes(std::string_view bytes) : rest_(bytes) {}

    [[nodiscard]] bool at_end() const { return rest_.empty(); }
    std::string_view take(std::size_t size) {
        EXPECT_LE(size, rest_.size());
        const std::string_view taken = rest_.substr(0, size);
        rest_.remove_prefix(std::min(size, rest_.size()));
        return taken;
    }
    std::uint32_t number() {
        std::uint32_t value = 0;
        for (const char byte : take(4)) {
            value = value << 8U | static_cast<unsigned char>(byte);
        }
        return value;
    }
    /// Ends with one to four zeros, so that the size is a multiple of four.
    std::string text() {
        const std::string text(rest_.substr(0, rest_.find('\0')));
        take((text.size() / 4 + 1) * 4);
        return text;
    }

private:
    std::string_view rest_;
};

struct OscMessage {
    std::string types;
    std::vector<float> floats;
    int integer = -1;
};

std::map<std::string, OscMessage> messages_of(std::string_view bundle) {
    std::map<std::string, OscMessage> messages;
    OscBytes bytes(bundle);
    EXPECT_EQ(bytes.text(), "#bundle");
    EXPECT_EQ(bytes.number(), 0U);
    EXPECT_EQ(bytes.number(), 1U);  // immediately
    while (!bytes.at_end()) {
        const std::uint32_t size = bytes.number();
        OscBytes content(bytes.take(size));
        const std::string path = content.text();
        OscMessage& message = messages[path];
        message.types = content.text();
        for (const char type : message.types.substr(1)) {
            if (type == 'f') {
                message.floats.push_back(std::bit_cast<float>(content.number()));
            } else {
                message.integer = static_cast<int>(content.number());
            }
        }
        EXPECT_TRUE(content.at_end());
    }
    return messages;
}

TEST(Osc, ABundleHasPositionAndAttitudeOfAValidPose) {
    host::ServedPose served{};
    served.pose.sensor = 1;
    served.pose.state = tracking::TrackerState::tracking;
    served.pose.position_m = {0.5, -0.25, 0.125};
    served.pose.q_source_sensor = Quat<double>(0.5, -0.5, 0.5, -0.5);
    auto messages = messages_of(host::osc_bundle(served));
    EXPECT_EQ(messages.size(), 3U);
    EXPECT_EQ(messages["/tricoil/2/valid"].types, ",i");
    EXPECT_EQ(messages["/tricoil/2/valid"].integer, 1);
    EXPECT_EQ(messages["/tricoil/2/position"].types, ",fff");
    EXPECT_THAT(messages["/tricoil/2/position"].floats, ::testing::ElementsAre(0.5F, -0.25F, 0.125F));
    EXPECT_THAT(messages["/tricoil/2/quaternion"].floats, ::testing::ElementsAre(0.5F, -0.5F, 0.5F, -0.5F));

    served.pose.flags.set(tracking::PoseFlag::roll_undefined);
    messages = messages_of(host::osc_bundle(served));
    EXPECT_EQ(messages.size(), 3U);
    EXPECT_THAT(messages["/tricoil/2/axis"].floats, ::testing::ElementsAre(0.0F, -1.0F, 0.0F));

    served.pose.flags.set(tracking::PoseFlag::low_signal);
    messages = messages_of(host::osc_bundle(served));
    EXPECT_EQ(messages.size(), 1U);
    EXPECT_EQ(messages["/tricoil/2/valid"].integer, 0);
}

TEST(Osc, AReceiverGetsTheSensorOfTheScenario) {
    const UdpReceiver receiver;
    const Serving serving({"--osc", receiver.port(), "--scenario", "still"});
    EXPECT_EQ(serving.address("osc"), "127.0.0.1:" + receiver.port());
    OscMessage position;
    for (int n = 0; n < 500 && position.floats.empty(); ++n) {  // until the first valid pose
        const std::string datagram = receiver.datagram();
        ASSERT_FALSE(datagram.empty());
        position = messages_of(datagram)["/tricoil/1/position"];
    }
    ASSERT_EQ(position.floats.size(), 3U);
    EXPECT_NEAR(position.floats[0], 0.5, 2e-3);  // where the sensor of this scenario rests
}

TEST(Osc, RefusesWrongOptions) {
    const std::vector<std::pair<std::string, std::string>> lines{
        {"--osc 99999", "--osc 99999: needs a port number up to 65535"},
        {"--osc 127.0.0.1", "--osc 127.0.0.1: needs a port number"},
        {"--osc 0", "--osc 127.0.0.1:0: name the port of the receiver"},
        {"--osc no-such-host.invalid:9000", "--osc no-such-host.invalid:9000"},
    };
    for (const auto& [options, reason] : lines) {
        const auto result = tricoil("serve " + options);
        EXPECT_TRUE(result.exit_code == 2 || result.err.find("the name server does not answer") != std::string::npos)
            << result.err;
        EXPECT_THAT(result.err, HasSubstr(reason)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

}  // namespace
}  // namespace tricoil::test
