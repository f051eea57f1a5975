// Requests to a device without tracking: identity, self-check, calibration, raw blocks, settings.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/linux/device_session.hpp"
#include "board/support/interrupt.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::linux_board {

/// Raw block, assembled from its parts.
struct RawBurst {
    protocol::RawBlockMessage about;  // header of the first part; its tail is empty
    std::vector<Sample> samples;
};

/// All functions throw DeviceError with one line if there is no answer in time, the request is refused, two devices answer, or
/// the link is lost, and Interrupted after a signal.
class DeviceInquiry {
public:
    /// `wait_s`: time-out of each answer. Throws InputError for an invalid URI.
    DeviceInquiry(const std::string& uri, double wait_s);

    const protocol::IdentifyMessage& identify();

    /// Empty if the device does not report its condition.
    std::optional<protocol::ConditionMessage> read_condition();

    protocol::ParametersMessage read_parameters();

    /// The next status message.
    protocol::StatusMessage read_status();

    /// Runs the device's self-check and returns all rows in order.
    std::vector<protocol::CheckMessage> self_check();

    /// Reads the device's calibration blob. The blob is not checked; empty: no calibration.
    std::vector<std::uint8_t> read_calibration();

    /// Returns when the device has confirmed that it stored `blob`.
    void write_calibration(const std::vector<std::uint8_t>& blob) { write_blob("write calibration", blob); }

    /// Writes a firmware image, from its vectors on, and restarts the device in it.
    void write_image(std::span<const std::uint8_t> image);

    /// Reads one raw block in this excitation state.
    RawBurst read_block(Excitation state);

    /// Sends a command and returns when the device has confirmed it. `what`: name of the request for error messages.
    void order(const char* what, protocol::Opcode opcode, std::uint32_t argument);

    /// Sets the boresight: the present attitude reads as straight ahead. An idle device is started for this, and stopped after a
    /// valid pose.
    void boresight();

    /// Calls each(message) for every message until `seconds` have passed (0: no limit) or a signal comes. Sends hello until the
    /// device has identified itself, and then only receives. Returns the number of messages.
    std::uint64_t listen(double seconds, const std::function<void(const hal::ReceivedMessage&)>& each);

    /// Starts the device and calls each(column) until `seconds` have passed (0: no limit) or a signal comes. Then the device is
    /// idle and set to poses. Throws DeviceError with the faults if the device reports one.
    void stream_columns(double seconds, const std::function<void(const protocol::ColumnMessage&)>& each);

    /// Reason why there is no session; empty during a session.
    [[nodiscard]] const char* detail() const { return session_.detail(); }

private:
    static constexpr Microseconds kAskAgain{1'000'000};
    using Ask = std::function<void()>;
    using Take = std::function<bool(const hal::ReceivedMessage&)>;

    bool exchange(double seconds, const host::InterruptGuard& guard, const Ask& ask, const Take& is_done,
                  Microseconds again = kAskAgain);
    void await_pose();
    std::uint32_t write_blob(const char* what, std::span<const std::uint8_t> blob);
    std::uint32_t inquire(const char* what, protocol::Opcode opcode, const Ask& ask, const Take& is_answer);
    void command(protocol::Opcode opcode, Excitation state = Excitation::off, std::uint32_t argument = 0);

    std::string uri_;
    double wait_s_;
    std::unique_ptr<hal::MessagePort> port_;
    DeviceSession session_;
    std::uint32_t calibrations_ = 0;  // number of sent calibrations
    std::uint16_t request_;
};

}  // namespace tricoil::linux_board
