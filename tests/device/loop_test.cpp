// DeviceLoop with coils driven by the host: coils are off after every end of a session; the heartbeat beats once per accepted
// column.
#include <gtest/gtest.h>

#include <deque>
#include <vector>

#include "board/linux/device_loop.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/protocol/convert.hpp"
#include "tests/device/column_message.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::linux_board {
namespace {

/// A front end that answers hello and start, and sends the messages that a test gives it.
class ScriptedPort final : public hal::MessagePort {
public:
    template <typename Message>
    void say(const Message& message) {
        queue_.push_back(test::bytes_of(message));
    }

private:
    Status do_open() override { return {}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> bytes) override {
        protocol::CommandMessage command;
        if (protocol::decode(bytes, command) != protocol::WireError::none) {
            return {};
        }
        if (command.opcode == static_cast<std::uint8_t>(protocol::Opcode::hello)) {
            protocol::IdentifyMessage identity;
            identity.drives_coils = 0;
            say(identity);
        } else if (command.opcode == static_cast<std::uint8_t>(protocol::Opcode::start)) {
            protocol::AckMessage ack;
            ack.opcode = command.opcode;
            ack.request = command.request;
            say(ack);
        }
        return {};
    }
    Status do_receive(hal::ReceivedMessage& message) override {
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
    EXPECT_EQ(heartbeat.beats, before) << "refused, all of them";
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
    EXPECT_TRUE(static_cast<hal::MessagePort&>(port).receive(rest).ok()) << "not all of it in one step";
}

TEST_F(Loop, StopsWithTheCoilsOff) {
    loop->stop();
    EXPECT_EQ(coils.state, Excitation::off);
}

/// Loop with a sensor that is visible to all coils.
class LoopWithSensor : public Loop {
protected:
    LoopWithSensor() {
        params.hemisphere = {1, 0, 0};
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, [this](const protocol::PoseMessage& pose) {
            pose_ = pose;
            without_side_ += side_is_unknown() ? 1 : 0;
        });
    }

    /// Sends a frame of three columns, with device times that are `ahead_us` too late.
    void see(std::int64_t ahead_us) {
        const Mat3<double> x =
            field::signal_matrix<double>(params.coupling_constant_m3, Vec3<double>(0.4, 0.1, 0.05), Mat3<double>::Identity());
        for (int n = 0; n < kSourceCoils; ++n) {
            const int coil = coil_index(coils.state);
            auto message = test::column_message(next++, 1 + coil, static_cast<std::uint32_t>(loop->counters().excitations));
            message.time_us += ahead_us;
            message.in_phase = {static_cast<float>(x(0, coil)), static_cast<float>(x(1, coil)), static_cast<float>(x(2, coil))};
            port.say(message);
            loop->step();
        }
    }
    [[nodiscard]] bool side_is_unknown() const {
        return (unsigned{pose_.flags} >> static_cast<unsigned>(tracking::PoseFlag::hemisphere_unknown) & 1U) != 0;
    }
    [[nodiscard]] double x_m() const { return 1e-6 * pose_.position[0]; }

    protocol::PoseMessage pose_;
    int without_side_ = 0;
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
    // A deskewing tracker confirms no pose before the third column of each coil: seven poses. The loop restores the side at the
    // next.
    EXPECT_EQ(without_side_, 8);
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST(HemisphereRestorer, RecoversOnlyWhatTheSensorCannotHaveChanged) {
    tracking::PoseEstimate<double> pose;
    pose.position_m = {0.5, 0, 0};
    tracking::PoseEstimate<double> lost = pose;
    lost.position_m = -pose.position_m;  // the mirror image
    lost.flags.set(tracking::PoseFlag::hemisphere_unknown);
    HemisphereRestorer restorer;
    EXPECT_FALSE(restorer.side(lost, host_time_us(1))) << "it was never known";
    EXPECT_FALSE(restorer.side(pose, host_time_us(1'000'000)));
    const auto side = restorer.side(lost, host_time_us(1'100'000));
    ASSERT_TRUE(side);
    EXPECT_GT(side->x(), 0);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'500'000))) << "half a second is enough to go round to the other side";
    lost.flags.set(tracking::PoseFlag::low_signal);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'100'000)));
}

}  // namespace
}  // namespace tricoil::linux_board
