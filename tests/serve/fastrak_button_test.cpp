// Button of the stylus: modes of command e, item 16, and the sources of the button.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <thread>

#include "drivers/posix/raw_terminal.hpp"
#include "tests/serve/fastrak_client.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

constexpr Microseconds kSwitchCycle{333'334};

tracking::PoseEstimate<double> pose_at(double x_in) { return fastrak_pose({x_in, 0, 0}, 0, 0, 0); }

TEST(FastrakButton, APressInPointModeSendsOneRecordPerActiveStation) {
    FastrakClient client(3);
    for (std::uint8_t sensor = 0; sensor < 3; ++sensor) {
        client.see(pose_at(10.0 + sensor), sensor);
    }
    client.say("l3,0\r");
    EXPECT_EQ(client.press(),
              "01   10.00   0.00   0.00   0.00   0.00   0.00\r\n02   11.00   0.00   0.00   0.00   0.00   0.00\r\n");
    EXPECT_EQ(client.see(pose_at(10)), "");
    EXPECT_EQ(client.press(false), "");
    EXPECT_EQ(client.press(), "");  // within a third of a second
    client.press(false);
    EXPECT_EQ(client.pass(kSwitchCycle), "");
    EXPECT_EQ(client.press().size(), 2 * kRecord);
}

TEST(FastrakButton, AHeldButtonRepeatsThreeTimesASecond) {
    FastrakClient client;
    client.see(pose_at(10));
    std::size_t bytes = client.press().size();
    for (int n = 0; n < 300; ++n) {
        bytes += client.see(pose_at(10)).size();  // 10 ms each
    }
    EXPECT_EQ(bytes, (1 + 8) * kRecord);  // 0.34 s each, because poses come every 10 ms
    client.press(false);
    EXPECT_EQ(client.pass(2 * kSwitchCycle), "");
}

TEST(FastrakButton, InMouseModeOnlyItem16ShowsTheButton) {
    FastrakClient client(2);
    client.see(pose_at(10));
    client.see(pose_at(10), 1);
    client.say("e1,0\rO1,16,1\rO2,16,1\r");
    EXPECT_EQ(client.press(), "");
    EXPECT_EQ(client.say("P"), "01  1\r\n02  0\r\n");  // only station 1 has a button
    EXPECT_EQ(client.say("fP"), "01  1\r\n02  0\r\n");
    client.press(false);
    EXPECT_EQ(client.say("P"), "01  0\r\n02  0\r\n");
    client.say("e1,1\r");
    EXPECT_EQ(client.press(), "01  1\r\n02  0\r\n");
}

TEST(FastrakButton, InContinuousModeAPressInterruptsAndResumes) {
    FastrakClient client;
    client.say("C");
    EXPECT_EQ(client.see(pose_at(10)).size(), kRecord);
    for (int n = 0; n < 2; ++n) {
        client.press();
        client.press(false);
        EXPECT_EQ(client.see(pose_at(10)), "");
        EXPECT_EQ(client.say("P").size(), kRecord);
        client.pass(kSwitchCycle);
        client.press();
        client.press(false);
        EXPECT_EQ(client.see(pose_at(10)).size(), kRecord);
        client.pass(kSwitchCycle);
    }
    client.press();
    client.say("cC");
    EXPECT_EQ(client.see(pose_at(10)).size(), kRecord);
    client.say("e1,0\r");
    client.pass(kSwitchCycle);
    client.press(false);
    client.press();
    EXPECT_EQ(client.see(pose_at(10)).size(), kRecord);
}

TEST(FastrakButton, AStationThatHasNotMovedByItsIncrementIsLeftOut) {
    FastrakClient client(2);
    client.see(pose_at(10));
    client.see(pose_at(20), 1);
    client.say("I2,1\r");
    EXPECT_EQ(client.press().size(), 2 * kRecord);
    client.press(false);
    client.pass(kSwitchCycle);
    client.see(pose_at(20.5), 1);
    EXPECT_EQ(client.press().substr(0, 2), "01");
    client.press(false);
    client.pass(kSwitchCycle);
    client.see(pose_at(21), 1);
    EXPECT_EQ(client.press().size(), 2 * kRecord);
}

TEST(FastrakButton, AClickIsHeldLongEnoughForARecord) {
    int notices = 0;
    host::StylusButton button([&] { ++notices; });
    EXPECT_FALSE(button.state().down);
    button.click();
    EXPECT_TRUE(button.state().down);
    EXPECT_EQ(button.state().presses, 1U);
    std::this_thread::sleep_for(std::chrono::microseconds(host::StylusButton::kClick.count() + 1000));
    EXPECT_FALSE(button.state().down);
    button.set(true);
    button.set(true);
    EXPECT_EQ(button.state().presses, 2U);
    button.set(false);
    EXPECT_FALSE(button.state().down);
    EXPECT_EQ(notices, 4);
}

/// A client of the FASTRAK on a pseudo terminal that has received a valid pose.
int open_client(const Serving& serving) {
    const int line = open(serving.path().c_str(), O_RDWR | O_NOCTTY);
    EXPECT_GE(line, 0);
    EXPECT_TRUE(drivers::make_raw(line));
    std::string record;
    for (int n = 0; n < 1000 && record.substr(0, 3) != "01 "; ++n) {
        EXPECT_EQ(write(line, "P", 1), 1);
        record = read_for(line, std::chrono::seconds(10), kRecord);
    }
    return line;
}

TEST(FastrakButton, LinesOfANamedPipePressIt) {
    const std::string pipe = path_in_temp("button_pipe");
    unlink(pipe.c_str());
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const Serving serving({"--fastrak", "pty", "--scenario", "still", "--button", pipe});
    const int line = open_client(serving);
    EXPECT_EQ(read_for(line, std::chrono::milliseconds(300)), "");
    for (int writer = 0; writer < 2; ++writer) {
        const int button = open(pipe.c_str(), O_WRONLY);
        ASSERT_EQ(write(button, "noise\r\n\r\n", 9), 9);  // the empty line is a click
        EXPECT_EQ(read_for(line, std::chrono::seconds(10), kRecord).substr(0, 2), "01");
        EXPECT_EQ(read_for(line, std::chrono::milliseconds(500)), "");
        close(button);
    }
    EXPECT_EQ(write(line, "e1,0\rO1,16,1\r", 14), 14);
    const int button = open(pipe.c_str(), O_WRONLY);
    const auto waits_for = [&](const std::string& wanted) {
        std::string record;
        for (int n = 0; n < 1000 && record != wanted; ++n) {
            EXPECT_EQ(write(line, "P", 1), 1);
            record = read_for(line, std::chrono::seconds(10), wanted.size());
        }
        return record == wanted;
    };
    EXPECT_TRUE(waits_for("01  0\r\n"));
    EXPECT_EQ(write(button, "1\n", 2), 2);
    EXPECT_TRUE(waits_for("01  1\r\n"));
    EXPECT_EQ(write(button, "0\n", 2), 2);
    EXPECT_TRUE(waits_for("01  0\r\n"));
    close(button);
    close(line);
}

TEST(FastrakButton, TheEnterKeyOfStandardInputPressesIt) {
    std::array<int, 2> keys{};
    ASSERT_EQ(pipe(keys.data()), 0);
    const int own_input = dup(STDIN_FILENO);
    dup2(keys[0], STDIN_FILENO);
    Serving serving({"--fastrak", "pty", "--scenario", "still", "--button", "-"});
    dup2(own_input, STDIN_FILENO);
    close(own_input);
    close(keys[0]);
    const int line = open_client(serving);
    EXPECT_EQ(write(keys[1], "\n", 1), 1);
    EXPECT_EQ(read_for(line, std::chrono::seconds(10), kRecord).substr(0, 2), "01");
    close(keys[1]);  // the end of the input does not end the program
    EXPECT_EQ(write(line, "P", 1), 1);
    EXPECT_EQ(read_for(line, std::chrono::seconds(10), kRecord).size(), kRecord);
    close(line);
    EXPECT_EQ(serving.stop(SIGTERM), 0);
}

TEST(FastrakButton, AControlRequestPressesIt) {
    const Serving serving({"--fastrak", "pty", "--web", "0", "--open-controls", "--scenario", "still"});
    const int line = open_client(serving);
    const auto ask = [&](const std::string& command) {
        const int client = connect_to(serving.port("web"));
        const std::string request =
            "POST /control HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) +
            "\r\nContent-Type: application/json\r\nConnection: close\r\nContent-Length: " + std::to_string(command.size()) +
            "\r\n\r\n" + command;
        EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
        const std::string answer = read_for(client, std::chrono::seconds(10));
        close(client);
        return answer.substr(0, answer.find('\r'));
    };
    EXPECT_THAT(ask(R"({"button":"click"})"), ::testing::HasSubstr("200"));
    EXPECT_EQ(read_for(line, std::chrono::seconds(10), kRecord).substr(0, 2), "01");
    EXPECT_EQ(read_for(line, std::chrono::milliseconds(500)), "");
    EXPECT_THAT(ask(R"({"button":true})"), ::testing::HasSubstr("200"));
    EXPECT_EQ(read_for(line, std::chrono::seconds(10), 3 * kRecord).size(), 3 * kRecord);  // held
    EXPECT_THAT(ask(R"({"button":false})"), ::testing::HasSubstr("200"));
    (void)read_for(line, std::chrono::milliseconds(500));
    EXPECT_EQ(read_for(line, std::chrono::milliseconds(500)), "");
    EXPECT_THAT(ask(R"({"button":1})"), ::testing::HasSubstr("400"));
    close(line);
}

TEST(FastrakButton, RefusesInvalidButtons) {
    const std::vector<std::tuple<std::string, int, std::string>> lines{
        {"--web 0 --button -", 2, "--button: only with --fastrak"},
        {"--fastrak pty --button /etc/passwd", 2, "must be -, a terminal, a serial port or a named pipe"},
        {"--fastrak pty --button /dev/no-such-line", 3, "is it plugged in?"}};
    for (const auto& [options, code, reason] : lines) {
        const auto result = tricoil("serve " + options);
        EXPECT_EQ(result.exit_code, code) << options;
        EXPECT_THAT(result.err, ::testing::HasSubstr(reason)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

}  // namespace
}  // namespace tricoil::test
