// Device session when the host drives the coils: accepted and refused columns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "board/linux/device_session.hpp"
#include "board/linux/repeated_texts.hpp"
#include "core/protocol/convert.hpp"
#include "tests/device/column_message.hpp"
#include "tests/protocol/random_messages.hpp"
#include "tests/support/deaf_port.hpp"

namespace tricoil::linux_board {
namespace {

using protocol::WireError;

SessionParams host_drives() {
    SessionParams params;
    params.host_drives_coils = true;
    return params;
}

class SessionOfCoils : public ::testing::Test {
protected:
    void SetUp() override {
        session.service(now);
        start();
    }

    void start() {
        say(identity);
        session.service(now += Microseconds{1});
        ASSERT_EQ(say(started()), SessionEvent::started);
    }

    /// Acknowledges the newest command, which is start.
    protocol::AckMessage started() const {
        protocol::AckMessage ack;
        ack.opcode = static_cast<std::uint8_t>(protocol::Opcode::start);
        ack.request = port.command().request;
        return ack;
    }
    [[nodiscard]] protocol::Opcode told() const { return static_cast<protocol::Opcode>(port.command().opcode); }

    template <typename Message>
    SessionEvent say(const Message& message) {
        const auto bytes = test::bytes_of(message);
        hal::ReceivedMessage received;
        received.bytes = bytes;
        received.arrival = now += Microseconds{1};
        return session.take(received);
    }

    /// A column of coil `coil` (1-3) that echoes `state_sequence`.
    protocol::ColumnMessage column(int coil, std::uint32_t state_sequence) {
        return test::column_message(next++, coil, state_sequence);
    }

    std::uint64_t refused() const { return session.refused().of(WireError::transition); }

    protocol::IdentifyMessage identity = [] {
        protocol::IdentifyMessage m;
        m.drives_coils = 0;
        return m;
    }();
    test::DeafPort port;
    DeviceSession session{port, host_drives()};
    HostTime now = host_time_us(1);
    std::uint32_t next = 0;
};

TEST_F(SessionOfCoils, AcceptsAColumnThatEchoesTheStateSequence) {
    session.note_excitation(Excitation::s1, 1);
    EXPECT_EQ(say(column(1, 1)), SessionEvent::column);
    session.note_excitation(Excitation::s2, 2);
    EXPECT_EQ(say(column(2, 2)), SessionEvent::column);
    EXPECT_EQ(refused(), 0U);
}

TEST_F(SessionOfCoils, RefusesASequenceThatWasNeverSent) {
    session.note_excitation(Excitation::s1, 1);
    EXPECT_EQ(say(column(1, 2)), SessionEvent::none);
    EXPECT_EQ(say(column(1, 0)), SessionEvent::none) << "before the first";
    EXPECT_EQ(say(column(1, 0x40000001)), SessionEvent::none);
    EXPECT_EQ(refused(), 3U);
    EXPECT_EQ(session.counters().columns, 0U);
    EXPECT_TRUE(session.take_window_over()) << "a refused column also ends its window";
}

TEST_F(SessionOfCoils, RefusesTheSequenceOfAnotherCoil) {
    session.note_excitation(Excitation::s1, 1);
    session.note_excitation(Excitation::s2, 2);
    EXPECT_EQ(say(column(2, 1)), SessionEvent::none);
    EXPECT_EQ(say(column(3, 2)), SessionEvent::none);
    EXPECT_EQ(say(column(2, 2)), SessionEvent::column);
    EXPECT_EQ(refused(), 2U);
}

TEST_F(SessionOfCoils, RefusesAnOldSequence) {
    for (std::uint32_t n = 1; n <= 5; ++n) {
        session.note_excitation(single_coil(static_cast<int>((n - 1) % 3)), n);
    }
    EXPECT_EQ(say(column(1, 1)), SessionEvent::none) << "four changes later";
    EXPECT_EQ(say(column(2, 5)), SessionEvent::column);
    EXPECT_EQ(refused(), 1U);
}

TEST_F(SessionOfCoils, RefusesAColumnThatSpansATransition) {
    session.note_excitation(Excitation::s1, 1);
    auto spanning = column(1, 1);
    spanning.flags |= protocol::kTransitionFlag;
    EXPECT_EQ(say(spanning), SessionEvent::none);
    EXPECT_EQ(say(column(1, 1)), SessionEvent::column);
    EXPECT_EQ(refused(), 1U);
}

TEST_F(SessionOfCoils, AcceptsEveryColumnOfAllCoilsAtOnce) {
    session.note_excitation(Excitation::all, 1);
    for (const int coil : {1, 2, 3}) {
        EXPECT_EQ(say(column(coil, 1)), SessionEvent::column);
    }
    EXPECT_EQ(say(column(1, 2)), SessionEvent::none);
    EXPECT_EQ(refused(), 1U);
}

TEST_F(SessionOfCoils, ForgetsStateSequencesFromBeforeARestart) {
    session.note_excitation(Excitation::s1, 1);
    session.service(now += Microseconds{600'000});  // silence
    session.service(now += Microseconds{200'000});
    ASSERT_NO_FATAL_FAILURE(start());
    EXPECT_EQ(say(column(1, 1)), SessionEvent::none);
    EXPECT_EQ(refused(), 1U);
}

TEST_F(SessionOfCoils, WindowOfSeveralSensorsEndsOnce) {
    identity.sensors = 2;
    session.service(now += Microseconds{600'000});
    ASSERT_NO_FATAL_FAILURE(start());
    session.note_excitation(Excitation::s1, 1);
    EXPECT_EQ(say(column(1, 1)), SessionEvent::column);
    EXPECT_TRUE(session.take_window_over());
    session.note_excitation(Excitation::s2, 2);
    auto of_the_other = column(1, 1);
    of_the_other.sensor = 1;
    of_the_other.time_us -= 1389;
    EXPECT_EQ(say(of_the_other), SessionEvent::column);
    EXPECT_FALSE(session.take_window_over()) << "the same window";
    EXPECT_EQ(say(column(2, 2)), SessionEvent::column);
    EXPECT_TRUE(session.take_window_over());
}

TEST_F(SessionOfCoils, StatusAloneDoesNotKeepTheSessionAlive) {
    session.note_excitation(Excitation::s1, 1);
    for (int n = 0; n < 7; ++n) {
        protocol::StatusMessage status;
        status.device_state = static_cast<std::uint8_t>(protocol::DeviceState::running);
        say(status);
        session.service(now += Microseconds{100'000});
    }
    EXPECT_NE(session.phase(), Phase::running);
    EXPECT_EQ(session.counters().silences, 1U);
}

TEST_F(SessionOfCoils, RefusedColumnsDoNotKeepTheSessionAlive) {
    session.note_excitation(Excitation::s1, 1);
    EXPECT_EQ(say(column(1, 1)), SessionEvent::column);
    next = 0x10000000;
    for (int n = 0; n < 7; ++n) {
        auto old = column(1, 1);
        old.sequence = 0x80000000U + static_cast<std::uint32_t>(n);
        say(old);
        session.service(now += Microseconds{100'000});
    }
    EXPECT_NE(session.phase(), Phase::running);
}

TEST_F(SessionOfCoils, SecondDeviceEndsTheRunAndBothGetStop) {
    session.note_excitation(Excitation::s1, 1);
    identity.serial = 7;
    say(identity);
    EXPECT_NE(session.phase(), Phase::running);
    EXPECT_EQ(told(), protocol::Opcode::stop);
    EXPECT_EQ(session.refused().of(WireError::duplicate_node), 1U);
}

TEST_F(SessionOfCoils, AnswerToAnotherHostStartsNothing) {
    session.service(now += Microseconds{600'000});
    say(identity);
    session.service(now += Microseconds{1});
    auto answer = started();
    answer.request = static_cast<std::uint16_t>(answer.request + 4711);
    EXPECT_EQ(say(answer), SessionEvent::none);
    EXPECT_EQ(session.phase(), Phase::starting);
    EXPECT_EQ(say(started()), SessionEvent::started);
}

TEST_F(SessionOfCoils, PoseOfAnUnknownSensorIsRefused) {
    session.service(now += Microseconds{600'000});
    identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
    ASSERT_NO_FATAL_FAILURE(start());
    protocol::PoseMessage pose;
    pose.quaternion[0] = static_cast<std::int32_t>(protocol::kQuaternionPerUnit);
    pose.sensor = identity.sensors;
    EXPECT_EQ(say(pose), SessionEvent::none);
    pose.sensor = 0;
    EXPECT_EQ(say(pose), SessionEvent::pose);
}

/// A tracker board that answers each start, and sends poses as its own clock and counter go.
class SessionOfAClock : public SessionOfCoils {
protected:
    void SetUp() override {
        identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
        identity.drives_coils = 1;
        start_again();
        pose.quaternion[0] = static_cast<std::int32_t>(protocol::kQuaternionPerUnit);
    }
    /// After a lost link of `away`.
    void start_again(Microseconds away = Microseconds{800'000}) {
        board.on_device_lost(now);
        board.service(now += away);
        tell(identity);
        board.service(now += Microseconds{1});
        ASSERT_EQ(tell(started()), SessionEvent::started);
    }
    template <typename Message>
    SessionEvent tell(const Message& message) {
        const auto bytes = test::bytes_of(message);
        return board.take({bytes, now, 0});
    }
    /// The next pose of the board; checks that times and numbers of those that leave increase.
    SessionEvent send() {
        now += Microseconds{4'000};
        pose.time_us += 4'000;
        ++pose.sequence;
        const DeviceTime time = board.pose().time;
        const std::uint32_t sequence = board.pose().sequence;
        const SessionEvent event = tell(pose);
        if (event == SessionEvent::pose) {
            EXPECT_GT(board.pose().time, time);
            EXPECT_GT(board.pose().sequence, sequence);
        }
        return event;
    }
    /// Sends `count` poses; returns how many leave.
    int send(int count) {
        int left = 0;
        for (int n = 0; n < count; ++n) {
            left += send() == SessionEvent::pose ? 1 : 0;
        }
        return left;
    }
    [[nodiscard]] std::int64_t left_us() const { return to_us(board.pose().time); }

    protocol::PoseMessage pose;
    DeviceSession board{port, {.hemisphere = Vec3<double>(Vec3<double>::Zero())}};
};

TEST_F(SessionOfAClock, ABoardThatRestartsGoesOn) {
    pose.time_us = 5'000'000;
    pose.sequence = 1'000;
    ASSERT_EQ(send(10), 10);
    const std::int64_t last_us = left_us();
    for (int restart = 1; restart <= 3; ++restart) {
        start_again();
        pose.time_us = 100'000;
        pose.sequence = 0;
        ASSERT_EQ(send(10), 10);
        EXPECT_NEAR(static_cast<double>(left_us() - last_us), restart * 840e3, 1e3) << "the host's time";
        EXPECT_EQ(board.pose().sequence, 1'010U + static_cast<std::uint32_t>(restart) * 10);
    }
}

TEST_F(SessionOfAClock, AClockThatRanOnStaysAsItIs) {
    pose.time_us = 5'000'000;
    pose.sequence = 1'000;
    ASSERT_EQ(send(10), 10);
    start_again();
    pose.time_us += 830'000;
    ASSERT_EQ(send(10), 10);
    EXPECT_EQ(left_us(), pose.time_us);
    EXPECT_EQ(board.pose().sequence, 1'020U);
    start_again();
    pose.time_us += 3'600'000'000;
    ASSERT_EQ(send(10), 10);
    EXPECT_EQ(left_us(), pose.time_us) << "a clock that is set forward";
}

/// By `jump_us` while it runs.
class SessionOfAJump : public SessionOfAClock, public testing::WithParamInterface<std::int64_t> {};

TEST_P(SessionOfAJump, StartsTheBoardAgainAndGoesOn) {
    pose.time_us = 50'000'000;
    ASSERT_EQ(send(10), 10);
    const std::int64_t last_us = left_us();
    pose.time_us += GetParam();
    EXPECT_EQ(send(20), 0);
    EXPECT_NE(board.phase(), Phase::running);
    EXPECT_STREQ(board.detail(), "the device's clock jumped");
    start_again();
    ASSERT_EQ(send(10), 10);
    EXPECT_EQ(board.counters().starts, 2U);
    EXPECT_GE(left_us(), last_us + 800'000);
}

INSTANTIATE_TEST_SUITE_P(Jumps, SessionOfAJump, testing::Values(-200'000, -3'000'000, -50'000'000, 2'000'000, 3'600'000'000));

TEST_F(SessionOfAClock, OneWrongTimeCostsOnePose) {
    pose.time_us = 5'000'000;
    ASSERT_EQ(send(10), 10);
    for (const std::int64_t wrong_us : {-2'000'000, 9'000'000}) {
        pose.time_us += wrong_us;
        EXPECT_EQ(send(), SessionEvent::none);
        pose.time_us -= wrong_us;
        EXPECT_EQ(send(10), 10);
    }
    EXPECT_EQ(board.counters().starts, 1U);
}

/// A column of a long window of the low band is older than those of the high band.
TEST_F(SessionOfCoils, ColumnsOfTheLowBandMayBeOld) {
    session.note_excitation(Excitation::all, 1);
    next = 1'000;
    EXPECT_EQ(say(column(1, 1)), SessionEvent::column);
    auto low = column(1, 1);
    low.flags = ColumnFlags{ColumnFlag::low_band}.bits();
    low.time_us -= 400'000;
    EXPECT_EQ(say(low), SessionEvent::column);
    EXPECT_EQ(say(column(2, 1)), SessionEvent::column);
}

TEST_F(SessionOfCoils, CountsMessagesDroppedSinceTheFirstStatus) {
    protocol::StatusMessage status;
    for (const auto dropped : {1000U, 1003U, 2U, 3U}) {  // the device restarts before the third status
        status.dropped = dropped;
        say(status);
    }
    EXPECT_EQ(session.counters().dropped, 4U);
}

TEST(SessionOfOldBoard, ReportsDifferentVersions) {
    test::DeafPort port;
    DeviceSession session(port, {});
    HostTime now = host_time_us(1);
    session.service(now);
    auto bytes = test::bytes_of(protocol::AckMessage{});
    bytes[0] = protocol::kOldestVersion - 1;
    session.take({bytes, now, 0});
    session.service(now += Microseconds{200'000});
    EXPECT_THAT(session.detail(), ::testing::HasSubstr("the device uses another protocol version"));
}

/// Its poses are of the channels as they are: a file of the host cannot correct them.
TEST(SessionOfBoard, AWiringFileNeedsColumns) {
    test::DeafPort port;
    SessionParams params;
    params.has_wiring = true;
    DeviceSession session(port, params);
    const HostTime now = host_time_us(1);
    session.service(now);
    protocol::IdentifyMessage identity;
    identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
    EXPECT_NE(session.take({test::bytes_of(identity), now, 0}), SessionEvent::identified);
    EXPECT_THAT(session.detail(), ::testing::HasSubstr("computes poses itself"));
    identity.role = static_cast<std::uint8_t>(protocol::Role::front_end);
    EXPECT_EQ(session.take({test::bytes_of(identity), now, 0}), SessionEvent::identified);
}

/// A device may forget the hemisphere when its start fails.
TEST(SessionOfBoard, SendsTheHemisphereAgainAfterARefusedStart) {
    test::DeafPort port;
    SessionParams params;
    params.hemisphere = Vec3<double>(0, 0, 1);
    DeviceSession session(port, params);
    HostTime now = host_time_us(1);
    const auto answer = [&](std::uint8_t result) {
        protocol::AckMessage ack;
        ack.opcode = port.command().opcode;
        ack.request = port.command().request;
        ack.result = result;
        session.take({test::bytes_of(ack), now, 0});
        session.take({test::bytes_of(protocol::StatusMessage{}), now += Microseconds{200'000}, 0});
        session.service(now);
        return static_cast<protocol::Opcode>(port.command().opcode);
    };
    session.service(now);
    protocol::IdentifyMessage identity;
    identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
    session.take({test::bytes_of(identity), now, 0});
    session.service(now += Microseconds{1});
    ASSERT_EQ(static_cast<protocol::Opcode>(port.command().opcode), protocol::Opcode::hemisphere);
    EXPECT_EQ(answer(1), protocol::Opcode::hemisphere);
    EXPECT_STREQ(session.detail(), "the device refuses the hemisphere (1)");
    EXPECT_EQ(answer(0), protocol::Opcode::start);
    EXPECT_EQ(answer(1), protocol::Opcode::hemisphere);
    EXPECT_STREQ(session.detail(), "the device refuses to start (1)");
}

/// A tracker board that answers each command of the session; the parameters only if it has some.
struct SessionOfParameters : testing::Test {
    protocol::Opcode told() { return static_cast<protocol::Opcode>(port.command().opcode); }
    void service() { session.service(now += Microseconds{110'000}); }
    void identify(std::uint64_t serial = 0) {
        protocol::IdentifyMessage identity;
        identity.serial = serial;
        identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
        session.take({test::bytes_of(identity), now, 0});
        service();
    }
    void acknowledge(protocol::AckResult result) {
        protocol::AckMessage ack;
        ack.opcode = port.command().opcode;
        ack.request = port.command().request;
        ack.result = static_cast<std::uint8_t>(result);
        session.take({test::bytes_of(ack), now, 0});
        service();
    }
    void answer(const Vec3<float>& towards, bool confined) {
        protocol::ParametersMessage m;
        m.values[protocol::kHemisphere] = protocol::hemisphere_argument({0, towards});
        m.values[protocol::kConfined] = confined ? 1 : 0;
        session.take({test::bytes_of(m), now, 0});
        service();
    }

    test::DeafPort port;
    HostTime now = host_time_us(1);
    DeviceSession session{port, {}};
};

TEST_F(SessionOfParameters, TakesTheRememberedHemisphere) {
    service();
    identify();
    ASSERT_EQ(told(), protocol::Opcode::read_parameters);
    answer({0, -1, 0}, true);
    EXPECT_EQ(told(), protocol::Opcode::hemisphere);
    EXPECT_LT(protocol::hemisphere_of_argument(port.command().argument).towards.y(), 0);
    EXPECT_TRUE(session.params().confined);
    acknowledge(protocol::AckResult::done);
    EXPECT_EQ(told(), protocol::Opcode::start);
}

TEST_F(SessionOfParameters, WithoutAHemisphereTheBoardHasItsOwn) {
    service();
    identify();
    answer({0, 0, 0}, true);
    EXPECT_EQ(told(), protocol::Opcode::start);
    EXPECT_FALSE(session.params().hemisphere);
    EXPECT_FALSE(session.params().confined) << "in no half space";
}

TEST_F(SessionOfParameters, OldFirmwareIsAskedOnce) {
    service();
    identify();
    ASSERT_EQ(told(), protocol::Opcode::read_parameters);
    acknowledge(protocol::AckResult::unknown);
    EXPECT_EQ(told(), protocol::Opcode::start);
    EXPECT_FALSE(session.parameters());
}

TEST_F(SessionOfParameters, ADeviceThatIgnoresTheQuestionIsStarted) {
    service();
    identify();
    for (int n = 0; n < 3; ++n) {
        ASSERT_EQ(told(), protocol::Opcode::read_parameters) << n;
        session.take({test::bytes_of(protocol::StatusMessage{}), now, 0});
        service();
    }
    EXPECT_EQ(told(), protocol::Opcode::start);
}

TEST_F(SessionOfCoils, FailingDeviceIsTriedAfterGrowingPauses) {
    std::vector<std::int64_t> pauses_us;
    for (int failure = 0; failure < 10; ++failure) {
        while (session.phase() == Phase::running) {
            session.service(now += Microseconds{10'000});
        }
        const HostTime failed = now;
        while (told() != protocol::Opcode::hello) {
            session.service(now += Microseconds{10'000});
        }
        pauses_us.push_back((now - failed).count());
        start();
    }
    EXPECT_LE(pauses_us.front(), 200'000);
    EXPECT_GE(pauses_us.back(), 10'000'000);
    EXPECT_LE(pauses_us.back(), 10'100'000);
    EXPECT_TRUE(std::is_sorted(pauses_us.begin(), pauses_us.end()));
}

TEST(RepeatedTexts, AreReportedOncePerMinuteOfSilence) {
    RepeatedTexts texts;
    EXPECT_TRUE(texts.should_print("a", host_time_us(1'000'000)));
    for (int n = 0; n < 100; ++n) {
        EXPECT_FALSE(texts.should_print("a", host_time_us(1'000'000 + n * 10'000'000)));
        EXPECT_EQ(texts.should_print("b", host_time_us(1'000'000 + n * 10'000'000)), n == 0);
    }
    EXPECT_EQ(texts.entries()[0].unprinted, 100U);
    EXPECT_TRUE(texts.should_print("a", host_time_us(2'000'000'000)));
}

}  // namespace
}  // namespace tricoil::linux_board
