// Link of a board to one host.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/sequence_check.hpp"
#include "hal/message_port.hpp"

namespace tricoil::app {

/// Opens its port if it is closed. A host is connected from its hello until the port is lost. It receives the stream between
/// start and stop.
class HostLink {
public:
    void attach(hal::MessagePort& port) { port_ = &port; }

    /// Next message of the host; false: none. Opens the port if that is due.
    bool receive(hal::ReceivedMessage& message, DeviceTime now);

    /// False if there is no room or no host. Counted as dropped if the host receives the stream.
    bool send(std::span<const std::uint8_t> bytes);

    /// Starts a new session; `sequence` is the number of the hello command.
    void start_session(std::uint32_t sequence);

    /// True if the sequence number of a command is new; stores it.
    bool is_new(std::uint32_t sequence) { return is_new(commands_, sequence); }
    /// The same for a calibration: hosts count messages per type.
    bool is_new_calibration(std::uint32_t sequence) { return is_new(calibrations_, sequence); }

    /// Notes the time of a valid command.
    void note_command(DeviceTime now) { last_command_time_ = now; }
    [[nodiscard]] DeviceTime last_command_time() const { return last_command_time_; }

    [[nodiscard]] bool has_session() const { return has_session_; }
    [[nodiscard]] bool streams() const { return streams_; }
    /// `alone`: also without a host.
    void stream(bool on, bool alone = false) {
        streams_ = on;
        needs_host_ = on && !alone;
    }
    [[nodiscard]] bool needs_host() const { return needs_host_; }

    /// True if an acknowledgement of an unreadable message may be sent: at most one per kReportPause.
    bool may_report_unreadable(DeviceTime now);

    [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

private:
    static constexpr Microseconds kOpenPause{100'000};
    static constexpr Microseconds kReportPause{10'000};

    static bool is_new(protocol::SequenceCheck& check, std::uint32_t sequence);
    void lose(DeviceTime now);

    hal::MessagePort* port_ = nullptr;
    bool is_open_ = false;
    bool has_session_ = false;
    bool streams_ = false;
    bool needs_host_ = false;  // streams until the host is silent
    DeviceTime due_{};         // next attempt to open the port
    DeviceTime last_command_time_{};
    DeviceTime last_report_{};
    protocol::SequenceCheck commands_;
    protocol::SequenceCheck calibrations_;
    std::uint32_t dropped_ = 0;
};

}  // namespace tricoil::app
