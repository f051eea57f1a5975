// DeviceLoop with coils driven by the host: coils are off after every end of a session; the heartbeat beats once per accepted
// column. After a lost link the hemisphere is known only if the sensor cannot have left it.
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <thread>
#include <vector>

#include "board/linux/device_loop.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/device/column_message.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::linux_board {
namespace {

/// A device that answers hello, hemisphere and start, and sends the messages that a test gives it.
class ScriptedPort final : public hal::MessagePort {
public:
    protocol::Role role = protocol::Role::front_end;
    bool is_unplugged = false;
    std::vector<Vec3<float>> hemispheres;  // received, in steps of 1/127
    std::size_t hemispheres_at_start = 0;  // before the newest start

    template <typename Message>
    void say(const Message& message) {
        queue_.push_back(test::bytes_of(message));
    }

private:
    Status do_open() override { return is_unplugged ? Status{StatusCode::device_lost, ""} : Status{}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> bytes) override {
        protocol::CommandMessage command;
        if (protocol::decode(bytes, command) != protocol::WireError::none) {
            return {};
        }
        if (command.opcode == static_cast<std::uint8_t>(protocol::Opcode::hello)) {
            protocol::IdentifyMessage identity;
            identity.role = static_cast<std::uint8_t>(role);
            identity.drives_coils = role == protocol::Role::tracker ? 1 : 0;
            say(identity);
        }
        const bool starts = command.opcode == static_cast<std::uint8_t>(protocol::Opcode::start);
        const bool sets = command.opcode == static_cast<std::uint8_t>(protocol::Opcode::hemisphere);
        if (sets) {
            hemispheres.push_back(protocol::hemisphere_of_argument(command.argument).towards);
        }
        hemispheres_at_start = starts ? hemispheres.size() : hemispheres_at_start;
        if (starts || sets) {
            protocol::AckMessage ack;
            ack.opcode = command.opcode;
            ack.request = command.request;
            say(ack);
        }
        return {};
    }
    Status do_receive(hal::ReceivedMessage& message) override {
        if (is_unplugged) {
            queue_.clear();
            return {StatusCode::device_lost, ""};
        }
        if (queue_.empty()) {
            return {StatusCode::not_ready, ""};
        }
        current_ = queue_.front();
        queue_.pop_front();
        message = {current_, HostTime{}, 0};
        return {};
    }
    Status do_wait(Microseconds) override { return {}; }
    [[nodiscard]] const char* do_detail() const override { return ""; }

    std::deque<std::vector<std::uint8_t>> queue_;
    std::vector<std::uint8_t> current_;
};

class NotingCoils final : public hal::CoilDriver {
public:
    Excitation state = Excitation::off;

private:
    Status do_excite(Excitation next) override {
        state = next;
        return {};
    }
    void do_switch_off() override { state = Excitation::off; }
};

class CountingHeartbeat final : public hal::Heartbeat {
public:
    int beats = 0;

private:
    Status do_beat() override {
        ++beats;
        return {};
    }
};

class Loop : public ::testing::Test {
protected:
    Loop() {
        params.session.host_drives_coils = true;
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, [](const protocol::PoseMessage&) {});
    }
    void SetUp() override {
        for (int n = 0; n < 5 && loop->session().phase() != Phase::running; ++n) {
            loop->step();
        }
        ASSERT_EQ(loop->session().phase(), Phase::running);
        ASSERT_EQ(coils.state, Excitation::s1);
    }

    /// The link is lost for `silence_ms`, then the device is found and started again.
    void lose_link(int silence_ms) {
        port.is_unplugged = true;
        loop->step();
        std::this_thread::sleep_for(std::chrono::milliseconds(silence_ms));
        port.is_unplugged = false;
        for (int n = 0; n < 1000 && loop->session().phase() != Phase::running; ++n) {
            loop->step();
        }
        ASSERT_EQ(loop->session().counters().starts, 2U);
        next = 0;
    }

    void column(int coil, std::uint32_t state_sequence) {
        port.say(test::column_message(next++, coil, state_sequence));
        loop->step();
    }

    ScriptedPort port;
    NotingCoils coils;
    CountingHeartbeat heartbeat;
    DeviceLoopParams params;
    std::optional<DeviceLoop> loop;
    std::uint32_t next = 0;
};

TEST_F(Loop, ASecondDeviceTakesTheCurrentFromTheCoils) {
    protocol::IdentifyMessage stranger;
    stranger.drives_coils = 0;
    stranger.serial = 99;
    port.say(stranger);
    loop->step();
    EXPECT_EQ(coils.state, Excitation::off);
}

TEST_F(Loop, TheHeartStandsForColumnsThatWereTaken) {
    const int before = heartbeat.beats;
    for (std::uint32_t n = 0; n < 10; ++n) {
        column(1, 4711);
    }
    EXPECT_EQ(heartbeat.beats, before) << "refused columns must cause no beat";
    const auto newest = static_cast<std::uint32_t>(loop->counters().excitations);
    column(1 + coil_index(coils.state), newest);
    EXPECT_EQ(heartbeat.beats, before + 1);
}

TEST_F(Loop, AFloodDoesNotHoldTheLoop) {
    for (int n = 0; n < 100'000; ++n) {
        port.say(protocol::StatusMessage{});
    }
    loop->step();
    loop->stop();
    EXPECT_EQ(coils.state, Excitation::off);
    hal::ReceivedMessage rest;
    EXPECT_TRUE(static_cast<hal::MessagePort&>(port).receive(rest).ok()) << "one step must not receive all messages";
}

TEST_F(Loop, StopsWithTheCoilsOff) {
    loop->stop();
    EXPECT_EQ(coils.state, Excitation::off);
}

/// Loop with a sensor that is visible to all coils.
class LoopWithSensor : public Loop {
protected:
    explicit LoopWithSensor(bool confined = false, const host::ToolTips& tips = {}) {
        params.tips = tips;
        params.hemisphere = {1, 0, 0};
        params.session.confined = confined;
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, [this](const protocol::PoseMessage& pose) {
            pose_ = pose;
            without_side_ += side_is_unknown() ? 1 : 0;
        });
    }

    /// Sends a frame of three columns with device times shifted by `ahead_us`.
    void see(std::int64_t ahead_us) {
        const Mat3<double> x = field::signal_matrix<double>(params.coupling_constant_m3, position_m_, Mat3<double>::Identity());
        for (int n = 0; n < kSourceCoils; ++n) {
            const int coil = coil_index(coils.state);
            auto message = test::column_message(next++, 1 + coil,
                                                static_cast<std::uint32_t>(loop->counters().excitations - excited_before_));
            message.time_us += ahead_us;
            message.in_phase = {static_cast<float>(x(0, coil)), static_cast<float>(x(1, coil)), static_cast<float>(x(2, coil))};
            port.say(message);
            loop->step();
        }
    }
    [[nodiscard]] bool side_is_unknown() const {
        return (unsigned{pose_.flags} >> static_cast<unsigned>(tracking::PoseFlag::hemisphere_unknown) & 1U) != 0;
    }
    [[nodiscard]] double x_m() const { return pose_.position[0] / protocol::kPositionPerMetre; }
    void see_frames(int count) {
        for (int frame = 0; frame < count; ++frame) {
            see(0);
        }
    }
    void restart_after(int silence_ms) {
        ASSERT_NO_FATAL_FAILURE(lose_link(silence_ms));
        excited_before_ = loop->counters().excitations - 1;
    }

    protocol::PoseMessage pose_;
    int without_side_ = 0;
    Vec3<double> position_m_{0.4, 0.1, 0.05};
    std::uint64_t excited_before_ = 0;  // in earlier sessions
};

host::ToolTips tip_of_sensor_0() {
    host::ToolTips tips;
    tips.set({0, {0.1, 0, 0}, Mat3<double>::Zero()});
    return tips;
}

class LoopWithTip : public LoopWithSensor {
protected:
    LoopWithTip() : LoopWithSensor(false, tip_of_sensor_0()) {}
};

TEST_F(LoopWithTip, DeliversThePosesOfTheTip) {
    see_frames(10);
    EXPECT_NEAR(x_m(), position_m_.x() + 0.1, 1e-4);
    EXPECT_FALSE(side_is_unknown());
}

class ConfinedLoop : public LoopWithSensor {
protected:
    ConfinedLoop() : LoopWithSensor(true) {}
};

TEST_F(LoopWithSensor, KnowsItsSideAgainAfterTheDevicesClockJumped) {
    for (int frame = 0; frame < 100; ++frame) {
        see(0);
    }
    ASSERT_FALSE(side_is_unknown());
    ASSERT_GT(x_m(), 0);
    for (int frame = 0; frame < 100; ++frame) {
        see(100'000'000);
    }
    // A deskewing tracker confirms no pose before the third column of each coil: seven poses. The loop restores the hemisphere
    // at the eighth pose.
    EXPECT_EQ(without_side_, 8);
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, DoesNotTrustTheConfiguredHemisphereAfterALongLoss) {
    see_frames(10);
    ASSERT_FALSE(side_is_unknown());
    restart_after(600);  // long enough for the sensor to reach its mirror image
    see_frames(10);
    EXPECT_TRUE(side_is_unknown());
    loop->set_hemisphere(0, {1, 0, 0});
    see_frames(1);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, AHemisphereThatIsSetWithoutALinkTakesEffectAtTheNextStart) {
    see_frames(10);
    port.is_unplugged = true;
    loop->step();
    loop->set_hemisphere(0, {1, 0, 0});
    restart_after(600);
    see_frames(3);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, ARefusedColumnIsNotTheNewest) {
    EXPECT_TRUE(loop->newest()) << "the start sets the newest time, so that silence before the first column is detected";
    see_frames(10);
    const auto newest = loop->newest();
    const auto rejected = loop->counters().rejected_columns;
    see(-20'000);  // the tracker refuses columns that go back in time
    EXPECT_EQ(loop->counters().rejected_columns, rejected + 3);
    EXPECT_EQ(loop->newest(), newest);
}

TEST_F(LoopWithSensor, FlagsPosesAfterALostOrRefusedColumn) {
    const auto is_flagged = [&] {
        return (unsigned{pose_.flags} >> static_cast<unsigned>(tracking::PoseFlag::columns_missing) & 1U) != 0;
    };
    see_frames(10);
    EXPECT_FALSE(is_flagged());
    ++next;  // a message is lost
    see_frames(1);
    EXPECT_TRUE(is_flagged());
    EXPECT_EQ(loop->session().counters().lost_columns, 1U);
    see_frames(2);
    EXPECT_FALSE(is_flagged());
    column(1, 4711);  // not the state sequence of the host: refused
    EXPECT_EQ(loop->session().counters().refused, 1U);
    see_frames(1);
    EXPECT_TRUE(is_flagged());
    see_frames(2);
    EXPECT_FALSE(is_flagged());
}

TEST_F(LoopWithSensor, TrustsTheConfiguredHemisphereIfNothingWasTracked) {
    restart_after(0);
    see_frames(10);
    EXPECT_FALSE(side_is_unknown());
}

TEST_F(LoopWithSensor, KnowsItsSideAfterAShortLoss) {
    position_m_ = {-2, 0, 0};  // 1.3 s from its mirror image, and not in the configured hemisphere
    loop->set_hemisphere(0, {-1, 0, 0});
    see_frames(10);
    ASSERT_LT(x_m(), 0);
    restart_after(0);  // the loop waits a tenth of a second before it opens the port again
    see_frames(10);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
    EXPECT_LT(x_m(), 0);
}

TEST_F(ConfinedLoop, KnowsItsSideAfterEveryLoss) {
    see_frames(10);
    restart_after(600);
    see_frames(3);
    EXPECT_EQ(without_side_, 0);
    EXPECT_GT(x_m(), 0);
}

/// A tracker board, which sends poses.
class LoopOfBoard : public Loop {
protected:
    explicit LoopOfBoard(bool confined = false, const host::ToolTips& tips = {}) {
        params.tips = tips;
        port.role = protocol::Role::tracker;
        params.session.host_drives_coils = false;
        params.session.hemisphere = Vec3<double>(0, 1e300, 0);
        params.session.confined = confined;
        loop.emplace(port, HostLines{nullptr, nullptr, nullptr}, params,
                     [this](const protocol::PoseMessage& pose) { delivered_ = pose; });
    }
    void SetUp() override {
        for (int n = 0; n < 5 && loop->session().phase() != Phase::running; ++n) {
            loop->step();
        }
        ASSERT_EQ(loop->session().phase(), Phase::running);
    }
    void pose(double y_m, bool is_known) {
        tracking::PoseEstimate<double> estimate;
        estimate.position_m = {0, y_m, 0};
        estimate.flags.set_if(!is_known, tracking::PoseFlag::hemisphere_unknown);
        protocol::PoseMessage message = protocol::to_message(estimate);
        message.sequence = next++;
        message.time_us = 1000 * next;
        port.say(message);
        loop->step();
    }
    protocol::PoseMessage delivered_;
};

class LoopOfBoardWithTip : public LoopOfBoard {
protected:
    LoopOfBoardWithTip() : LoopOfBoard(false, tip_of_sensor_0()) {}
};

TEST_F(LoopOfBoardWithTip, DeliversThePosesOfTheTip) {
    pose(0.4, true);
    EXPECT_NEAR(delivered_.position[0] / protocol::kPositionPerMetre, 0.1, 1e-6);
    EXPECT_NEAR(delivered_.position[1] / protocol::kPositionPerMetre, 0.4, 1e-6);
    EXPECT_EQ(delivered_.sequence, loop->session().pose_message().sequence);
    EXPECT_EQ(delivered_.time_us, loop->session().pose_message().time_us);
}

class ConfinedLoopOfBoard : public LoopOfBoard {
protected:
    ConfinedLoopOfBoard() : LoopOfBoard(true) {}
};

const Vec3<float> kPlusY(0, 127, 0);

TEST_F(LoopOfBoard, TellsTheHemisphereBeforeTheFirstStartAndTakesItBackBeforeTheNext) {
    EXPECT_EQ(port.hemispheres, std::vector{kPlusY});
    EXPECT_EQ(port.hemispheres_at_start, 1U);
    pose(0.4, true);
    lose_link(600);
    pose(0.4, false);
    EXPECT_EQ(port.hemispheres, (std::vector<Vec3<float>>{kPlusY, Vec3<float>::Zero()})) << "the sensor may be anywhere";
    EXPECT_EQ(port.hemispheres_at_start, 2U);
    loop->set_hemisphere(0, {0, std::nan(""), 0});
    loop->set_hemisphere(1, {0, 1, 0});
    EXPECT_EQ(port.hemispheres.size(), 2U) << "NaN and the hemisphere of sensor 1 must not be sent";
    loop->set_hemisphere(0, {0, 1, 0});
    EXPECT_EQ(port.hemispheres.back(), kPlusY);
}

TEST_F(LoopOfBoard, RestoresTheHemisphereAfterAShortLoss) {
    pose(-2, true);
    lose_link(0);
    pose(2, false);
    pose(2, false);  // sent before the command arrived
    EXPECT_EQ(port.hemispheres, (std::vector<Vec3<float>>{kPlusY, Vec3<float>::Zero(), -kPlusY}));
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
}

TEST_F(ConfinedLoopOfBoard, TellsTheHemisphereAfterEveryLoss) {
    pose(0.4, true);
    lose_link(600);
    EXPECT_EQ(port.hemispheres, (std::vector{kPlusY, kPlusY}));
    pose(0.4, false);
    EXPECT_EQ(port.hemispheres.back(), kPlusY);
    EXPECT_EQ(port.hemispheres.size(), 3U);
}

TEST(HemisphereRestorer, RecoversOnlyWhatTheSensorCannotHaveChanged) {
    tracking::PoseEstimate<double> pose;
    pose.position_m = {0.5, 0, 0};
    tracking::PoseEstimate<double> lost = pose;
    lost.position_m = -pose.position_m;  // the mirror image
    lost.flags.set(tracking::PoseFlag::hemisphere_unknown);
    HemisphereRestorer restorer;
    EXPECT_FALSE(restorer.side(lost, host_time_us(1))) << "the hemisphere was never known";
    EXPECT_FALSE(restorer.side(pose, host_time_us(1'000'000)));
    const auto side = restorer.side(lost, host_time_us(1'100'000));
    ASSERT_TRUE(side);
    EXPECT_GT(side->x(), 0);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'500'000))) << "in half a second the sensor can reach its mirror image";
    lost.flags.set(tracking::PoseFlag::low_signal);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'100'000)));
}

}  // namespace
}  // namespace tricoil::linux_board
