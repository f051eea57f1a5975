// DeviceLoop on a scripted device.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <optional>
#include <thread>
#include <vector>

#include "board/linux/device_loop.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/device/column_message.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::linux_board {

/// A device that answers hello, hemisphere and start, and sends the messages that a test gives it.
class ScriptedPort final : public hal::MessagePort {
public:
    protocol::Role role = protocol::Role::front_end;
    std::uint8_t sensors = 1;
    bool is_unplugged = false;
    bool is_silent = false;                // neither answers nor sends
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
            identity.sensors = sensors;
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
        if (queue_.empty() || is_silent) {
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
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, tap, [](const tracking::PoseEstimate<double>&) {});
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
    tracking::TrackerTap<double> tap;
    std::optional<DeviceLoop> loop;
    std::uint32_t next = 0;
};

inline host::ToolTips tip_of_sensor_0() {
    host::ToolTips tips;
    (void)tips.set({0, {0.1, 0, 0}, Mat3<double>::Zero()});
    return tips;
}

}  // namespace tricoil::linux_board
