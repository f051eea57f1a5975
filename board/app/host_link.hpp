// One link of a board, and what is known of the host behind it.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/sequence_check.hpp"
#include "hal/message_port.hpp"

namespace tricoil::app {

/// Opens its port whenever that is closed. A host is there once it has said hello, until the port is lost; it takes the stream
/// between start and stop.
class HostLink {
public:
    void attach(hal::MessagePort& port) { port_ = &port; }

    /// The next message of a host; false: none. Opens the port if that is due.
    bool receive(hal::ReceivedMessage& message, DeviceTime now);

    /// False: no room, or nobody there; counted if a host takes the stream.
    bool send(std::span<const std::uint8_t> bytes);

    /// A hello: whatever was, a new conversation begins with this number.
    void greet(std::uint32_t sequence);

    /// Whether a command's number is one that has not been before; takes note of it.
    bool is_new(std::uint32_t sequence) { return is_new(commands_, sequence); }
    /// The same of a calibration's number: a host counts its messages by type.
    bool is_new_calibration(std::uint32_t sequence) { return is_new(calibrations_, sequence); }

    /// Something that was right has been heard.
    void hear(DeviceTime now) { heard_ = now; }
    [[nodiscard]] DeviceTime heard() const { return heard_; }

    [[nodiscard]] bool is_greeted() const { return is_greeted_; }
    [[nodiscard]] bool streams() const { return streams_; }
    void stream(bool on) { streams_ = on; }

    /// May a complaint about an unreadable message be sent? One in kComplaintPause: noise must not be answered with noise.
    bool may_complain(DeviceTime now);

    [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

private:
    static constexpr Microseconds kOpenPause{100'000};
    static constexpr Microseconds kComplaintPause{10'000};

    static bool is_new(protocol::SequenceCheck& check, std::uint32_t sequence);
    void lose(DeviceTime now);

    hal::MessagePort* port_ = nullptr;
    bool is_open_ = false;
    bool is_greeted_ = false;
    bool streams_ = false;
    DeviceTime due_{};  // of the next try to open
    DeviceTime heard_{};
    DeviceTime complained_{};
    protocol::SequenceCheck commands_;
    protocol::SequenceCheck calibrations_;
    std::uint32_t dropped_ = 0;
};

}  // namespace tricoil::app
