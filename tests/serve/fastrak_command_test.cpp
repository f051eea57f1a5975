// Effects of commands: stations, rates, error letters, coordinate frames, and settings that survive a reset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/serve/fastrak_client.hpp"

namespace tricoil::test {
namespace {

using tracking::PoseFlag;

std::vector<double> numbers(const std::string& record) {
    std::vector<double> values;
    for (std::size_t at = 3; at + 7 <= record.size(); at += 7) {
        values.push_back(std::stod(record.substr(at, 7)));
    }
    return values;
}

TEST(FastrakCommand, ErrorLetters) {
    const std::vector<std::pair<PoseFlag, char>> letters{
        {PoseFlag::saturated, 'j'},     {PoseFlag::low_signal, 'k'},         {PoseFlag::no_sensor, 'l'},
        {PoseFlag::stale, 'l'},         {PoseFlag::no_reference, 'a'},       {PoseFlag::wrong_handedness, 'g'},
        {PoseFlag::not_converged, 's'}, {PoseFlag::hemisphere_unknown, 's'}, {PoseFlag::unconfirmed, 's'},
        {PoseFlag::inconsistent, 's'},  {PoseFlag::uncertain, 's'},          {PoseFlag::distorted, ' '},
        {PoseFlag::coasting, ' '},      {PoseFlag::columns_missing, ' '}};
    for (const auto& [flag, letter] : letters) {
        FastrakClient client;
        auto pose = fastrak_pose({10, 0, 0}, 0, 0, 0);
        pose.flags.set(flag);
        client.see(pose);
        EXPECT_EQ(client.say("P")[2], letter) << static_cast<int>(flag);
        const std::string bit = letter == ' ' ? "   " : std::to_string(static_cast<int>(letter));
        EXPECT_THAT(client.say("S").substr(6, 3), ::testing::HasSubstr(bit.substr(0, 2)));
    }
    // Every flag that makes a pose invalid has a letter.
    for (unsigned bit = 0; bit < 14; ++bit) {
        tracking::PoseEstimate<double> pose;
        pose.flags.set(static_cast<PoseFlag>(bit));
        EXPECT_EQ(host::fastrak::error_letter(pose) == ' ', pose.valid()) << bit;
    }
    FastrakClient client;
    EXPECT_EQ(client.say("P")[2], 'l');  // no pose yet
    client.see(fastrak_pose({100, 0, 0}, 0, 0, 0));
    EXPECT_EQ(client.say("P")[2], 'x');  // 2.54 m
}

TEST(FastrakCommand, ContinuousAtMost120TimesASecond) {
    FastrakClient client;
    const auto pose = fastrak_pose({10, 0, 0}, 0, 0, 0);
    EXPECT_EQ(client.see(pose), "");
    client.say("C");
    EXPECT_EQ(client.see(pose).size(), 47U);
    client.say("c");
    EXPECT_EQ(client.see(pose), "");

    std::size_t records = 0;
    host::fastrak::Session session({[&](std::string_view) { ++records; }, [](auto, const auto&) {}, [] { return 1; }, {}, {}},
                                   std::make_shared<host::fastrak::Memory>());
    session.receive(std::string_view("C"));
    std::mt19937 random(5);
    for (int n = 0; n < 2400; ++n) {  // 10 s at 240 Hz, arriving with jitter
        const host::ServedPose served{pose, host::utc_time_us(1'000'000 + n * 4167 + static_cast<int>(random() % 500))};
        session.take({&served, 1});
    }
    EXPECT_NEAR(static_cast<double>(records), 1200, 3);
}

TEST(FastrakCommand, ANoticeSaysOnceThatARollIsUndefined) {
    std::vector<std::string> notices;
    host::fastrak::Session session(
        {[](std::string_view) {}, {}, [] { return 1; }, {}, {}, [&](std::string_view notice) { notices.emplace_back(notice); }},
        std::make_shared<host::fastrak::Memory>());
    host::ServedPose served{fastrak_pose({10, 0, 0}, 0, 0, 0), host::utc_time_us(1'000'000)};
    session.take({&served, 1});
    served.pose.flags.set(PoseFlag::roll_undefined);
    session.take({&served, 1});
    session.take({&served, 1});
    EXPECT_THAT(notices, ::testing::ElementsAre(::testing::HasSubstr("station 1, whose roll is undefined")));
}

TEST(FastrakCommand, SilenceIsReportedToAContinuousClient) {
    std::vector<std::string> records;
    host::fastrak::Session session(
        {[&](std::string_view record) { records.emplace_back(record); }, [](auto, const auto&) {}, [] { return 1; }, {}, {}},
        std::make_shared<host::fastrak::Memory>());
    session.receive(std::string_view("C"));
    host::ServedPose served{fastrak_pose({10, 0, 0}, 0, 0, 0), host::utc_time_us(1'000'000)};
    session.take({&served, 1});
    served.pose.flags.set(PoseFlag::stale);  // as SilenceWatch does: the last pose again, time unchanged
    session.take({&served, 1});
    session.take({&served, 1});
    ASSERT_EQ(records.size(), 2U);
    EXPECT_EQ(records[0].substr(0, 3), "01 ");
    EXPECT_EQ(records[1].substr(0, 3), "01l");
    served.pose.flags = {};
    served.utc += Microseconds{1000};
    session.take({&served, 1});
    ASSERT_EQ(records.size(), 3U);
    EXPECT_EQ(records[2].substr(0, 3), "01 ");
}

TEST(FastrakCommand, ALaterClientGetsTheNewestPose) {
    std::string sent;
    host::fastrak::Session session(
        {[&](std::string_view record) { sent += record; }, [](auto, const auto&) {}, [] { return 1; }, {}, {}},
        std::make_shared<host::fastrak::Memory>());
    const host::ServedPose served{fastrak_pose({10, 0, 0}, 0, 0, 0), host::utc_time_us(1'000'000)};
    session.set_newest({&served, 1});
    EXPECT_EQ(sent, "");
    session.receive(std::string_view("P"));
    EXPECT_EQ(sent.substr(0, 10), "01   10.00");
}

TEST(FastrakCommand, StationsInTurn) {
    FastrakClient client(3);
    for (std::uint8_t sensor = 0; sensor < 3; ++sensor) {
        client.see(fastrak_pose({10.0 * (sensor + 1), 0, 0}, 0, 0, 0), sensor);
    }
    EXPECT_EQ(client.say("l1\r"), "21l1110\r\n");
    std::string records = client.say("P");
    ASSERT_EQ(records.size(), 3 * 47U);
    EXPECT_EQ(records.substr(0, 10), "01   10.00");
    EXPECT_EQ(records.substr(47, 10), "02   20.00");
    client.say("l2,0\r");
    records = client.say("P");
    ASSERT_EQ(records.size(), 2 * 47U);
    EXPECT_EQ(records.substr(47, 2), "03");
    EXPECT_EQ(client.say("l2\r"), "22l1010\r\n");
    EXPECT_EQ(client.say("S").substr(0, 3), "21S");
    EXPECT_EQ(client.say("S").substr(0, 3), "22S");
}

TEST(FastrakCommand, TheStreamBeginsWithTheFirstActiveStation) {
    FastrakClient client(3);
    const auto pose = fastrak_pose({10, 0, 0}, 0, 0, 0);
    for (std::uint8_t sensor = 0; sensor < 3; ++sensor) {
        client.see(pose, sensor);
    }
    client.say("l1,0\rC");
    EXPECT_EQ(client.see(pose, 2), "");
    EXPECT_EQ(client.see(pose, 0), "");
    EXPECT_EQ(client.see(pose, 1).substr(0, 2), "02");
    EXPECT_EQ(client.see(pose, 2).substr(0, 2), "03");
    client.say("\x13");
    EXPECT_EQ(client.see(pose, 1), "");
    client.say("\x11");
    EXPECT_EQ(client.see(pose, 2), "");
    EXPECT_EQ(client.see(pose, 1).substr(0, 2), "02");
    EXPECT_EQ(client.see(pose, 2).substr(0, 2), "03");
    auto silent = pose;
    silent.flags.set(PoseFlag::stale);
    client.say("c");
    client.see(silent, 1);
    client.say("C");
    EXPECT_EQ(client.see(pose, 2).substr(0, 2), "03");  // a silent station does not delay the others
}

TEST(FastrakCommand, HemisphereGoesToTheTracker) {
    FastrakClient client(2);
    client.say("H2,0,-1,0\r");
    ASSERT_EQ(client.hemispheres.size(), 1U);
    EXPECT_EQ(client.hemispheres[0].first, 1);
    EXPECT_EQ(client.hemispheres[0].second, Vec3<double>(0, -1, 0));
    client.say("H1,0,0,0\r");  // hemisphere tracking, the default
    EXPECT_EQ(client.hemispheres.size(), 1U);
}

TEST(FastrakCommand, TipTurnsWithTheSensor) {
    FastrakClient client;
    client.see(fastrak_pose({10, 0, 0}, 90, 0, 0));
    client.say("N1,4,0,0\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {10, 4, 0, 90, 0, 0}));
}

TEST(FastrakCommand, AlignmentIsRelativeToThePresentOne) {
    FastrakClient client;
    client.see(fastrak_pose({10, 20, 30}, 90, 0, 0));
    client.say("A1,0,0,0,0,1,0,-1,0,0\r");  // x along +y
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {20, -10, 30, 0, 0, 0}));
    client.say("A1,20,-10,30,21,-10,30,20,-9,30\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {0, 0, 0, 0, 0, 0}));
    client.say("R1\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {10, 20, 30, 90, 0, 0}));
}

TEST(FastrakCommand, BoresightReadsTheReferenceAngles) {
    FastrakClient client;
    client.say("G1,0,-15,0\r");
    client.say("B1\r");  // no pose yet: no effect
    client.see(fastrak_pose({10, 0, 0}, 33, 22, 11));
    EXPECT_THAT(numbers(client.say("P"))[3], ::testing::DoubleNear(33, 0.006));
    client.say("B1\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {10, 0, 0, 0, -15, 0}));
}

TEST(FastrakCommand, RestartRestoresTheSavedSettings) {
    FastrakClient client;
    client.see(fastrak_pose({10, 0, 0}, 0, 0, 0));
    client.say("O1,2,1\ru\x0b");
    client.say("O1,4,1\rU");
    EXPECT_EQ(client.say("O1\r"), "21O 4 1\r\n");
    client.say("\x19");
    EXPECT_EQ(client.say("O1\r"), "21O 2 1\r\n");
    client.see(fastrak_pose({10, 0, 0}, 0, 0, 0));
    EXPECT_THAT(numbers(client.say("P"))[0], ::testing::DoubleNear(25.4, 0.006));
}

TEST(FastrakCommand, EnvelopesGiveErrorLettersForTheReportedPose) {
    FastrakClient client(2);
    client.see(fastrak_pose({30.5, 0, 0}, 50, 0, 0));
    client.see(fastrak_pose({30.5, 0, 0}, 50, 0, 0), 1);
    client.say("V1,30,30,30,-30,-30,-30\r");
    EXPECT_EQ(client.say("P").substr(0, 3), "01x");
    EXPECT_EQ(client.say("T120\r"), "2 T120 0000\r\n");  // no new pose yet
    client.see(fastrak_pose({30.5, 0, 0}, 50, 0, 0));
    EXPECT_EQ(client.say("T120\r"), "2 T120 1000\r\n");
    EXPECT_EQ(client.say("S").substr(6, 3), "120");
    client.say("A1,1,0,0,2,0,0,1,1,0\r");
    EXPECT_EQ(client.say("P").substr(0, 3), "01 ");  // 29.5 inches from the origin of the alignment
    client.say("Q1,45,45,180,-45,-45,-180\r");
    EXPECT_EQ(client.say("P").substr(0, 3), "01y");
    EXPECT_EQ(client.say("P").substr(47, 3), "02 ");
    client.say("B1\r");
    EXPECT_EQ(client.say("P").substr(0, 3), "01 ");
    client.say("V1,1,30,30\r");
    EXPECT_EQ(client.say("P").substr(0, 3), "01x");
}

TEST(FastrakCommand, ContinuousRecordsNeedTheIncrement) {
    FastrakClient client;
    client.say("I1,2\rC");
    EXPECT_EQ(client.see(fastrak_pose({10, 0, 0}, 0, 0, 0)).size(), 47U);
    EXPECT_EQ(client.see(fastrak_pose({11.9, 1.9, -1.9}, 90, 0, 0)), "");
    EXPECT_EQ(client.say("P").size(), 47U);  // a request is always answered
    EXPECT_EQ(client.see(fastrak_pose({12.1, 0, 0}, 0, 0, 0)), "");
    EXPECT_EQ(client.see(fastrak_pose({12.1, -0.2, 0}, 0, 0, 0)).size(), 47U);
    client.say("I1,0\r");
    EXPECT_EQ(client.see(fastrak_pose({12.1, -0.2, 0}, 0, 0, 0)).size(), 47U);
}

TEST(FastrakCommand, SuspensionStopsTheStreamOnly) {
    FastrakClient client;
    const auto pose = fastrak_pose({10, 0, 0}, 0, 0, 0);
    client.say("C");
    EXPECT_EQ(client.see(pose).size(), 47U);
    for (const char* resume : {"\x11", "\x11", "C"}) {
        client.say("\x13");
        EXPECT_EQ(client.see(pose), "");
        EXPECT_EQ(client.say("P").size(), 47U);
        EXPECT_EQ(client.say("S").size(), 55U);
        client.say(resume);
        EXPECT_EQ(client.see(pose).size(), 47U);
    }
    client.say("\x13\x19");
    client.say("C");
    EXPECT_EQ(client.see(pose).size(), 47U);
}

TEST(FastrakCommand, TheMountingFrameTurnsPositionAndAttitude) {
    FastrakClient client;
    client.see(fastrak_pose({10, 20, 30}, 100, 0, 0));
    client.say("r1,90,0,0\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {20, -10, 30, 10, 0, 0}));
    client.say("A1,20,-10,0,21,-10,0,20,-9,0\r");  // relative to the mounting frame
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {0, 0, 30, 10, 0, 0}));
    client.say("B1\rR1\r");
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {20, -10, 30, 0, 0, 0}));
    client.say("b1\rr1,0,0,180\r");  // the transmitter is mounted upside down
    EXPECT_THAT(numbers(client.say("P")), ::testing::Pointwise(::testing::DoubleNear(0.006), {10, -20, -30, -100, 0, 180}));
}

TEST(FastrakCommand, OutputPortSetsTheSpeedOfTheLine) {
    std::vector<int> speeds;
    host::fastrak::Session session({[](std::string_view) {}, {}, [] { return 1; }, [&](int baud) { speeds.push_back(baud); }, {}},
                                   std::make_shared<host::fastrak::Memory>());
    const auto say = [&](std::string_view text) { session.receive(text); };
    say("o192,N,8,0\r\x0b");
    say("o96,N,8,0\r");
    say("o96,O,8,0\r");  // refused
    say("\x19");         // the saved speed
    EXPECT_THAT(speeds, ::testing::ElementsAre(19200, 9600, 19200));
}

TEST(FastrakCommand, NumbersNeverOutgrowTheirFields) {
    FastrakClient client;
    auto pose = fastrak_pose({1e7, -1e7, 0}, 0, 0, 0);
    pose.position_m.z() = std::nan("");
    client.see(pose);
    EXPECT_EQ(client.say("P").size(), 47U);
    EXPECT_EQ(client.say("O1,2,52,1\rP").size(), 3 + 21 + 39 + 2U);
}

TEST(FastrakCommand, ArbitraryBytesAreSurvived) {
    std::mt19937 random(11);
    FastrakClient client(2);
    client.see(fastrak_pose({10, 0, 0}, 0, 0, 0));
    for (int n = 0; n < 20'000; ++n) {
        std::string bytes(1 + random() % 12, ' ');
        const std::string_view likely =
            "CcPSOHBbGARNIQVrDdToXxvlyFfUuWY\x11\x13"
            "0123456789,.-eE\r\r\n";
        for (char& c : bytes) {
            c = random() % 4 == 0 ? static_cast<char>(random() % 256) : likely[random() % likely.size()];
        }
        client.say(bytes);
        client.see(fastrak_pose({10, 0, 0}, 0, 0, 0));
    }
    client.say("\rW\x0b\x19");
    client.see(fastrak_pose({10, 0, 0}, 0, 0, 0));
    EXPECT_EQ(client.say("P").size(), 2 * 47U);
}

}  // namespace
}  // namespace tricoil::test
