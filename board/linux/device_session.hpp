// Session with one front end or tracker board: finds it, checks the version, starts it, resets its watchdog, and reconnects after
// silence or a lost link. Every message is checked. No heap after construction.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "board/linux/continued_clock.hpp"
#include "board/stream/continued_sequence.hpp"
#include "core/protocol/clock_map.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/sequence_check.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"
#include "drivers/posix/text.hpp"
#include "hal/message_port.hpp"

namespace tricoil::linux_board {

struct SessionParams {
    std::uint64_t serial = 0;  // required serial number; 0: any
    bool host_drives_coils = false;
    bool start = true;        // false: only identify the device
    bool any_coils = false;   // true: accept any driver of the coils
    bool dual_band = false;   // true: accept only columns of two bands
    bool has_wiring = false;  // true: accept only columns, to which the wiring of a file applies

    // Hemisphere of the sensors; empty: both are read from the device's parameters. After valid poses it is unknown at the next
    // start, because the sensor may have left it while the link was down. With `confined` it stays known.
    std::optional<Vec3<double>> hemisphere;
    bool confined = false;
};

enum class Phase : std::uint8_t { closed, greeting, starting, running };

enum class SessionEvent : std::uint8_t { none, identified, started, column, pose };

struct SessionCounters {
    std::uint64_t columns = 0;
    std::uint64_t poses = 0;
    std::uint64_t lost_columns = 0;  // gaps in the sequence
    std::uint64_t lost_poses = 0;
    std::uint64_t refused = 0;   // columns and poses in sequence, but with wrong contents
    std::uint64_t dropped = 0;   // messages that the device could not send, since its first status
    std::uint64_t starts = 0;    // number of starts of a device
    std::uint64_t silences = 0;  // number of time-outs of a device
};

/// After a failure the next try waits 0.1 s. The pause doubles with each failure up to kLongestPause, until the device is
/// steady.
class DeviceSession {
public:
    static constexpr Microseconds kSteady{2'000'000};
    static constexpr Microseconds kLongestPause{10'000'000};

    DeviceSession(hal::MessagePort& port, const SessionParams& params)
        : port_(port), params_(params), reads_parameters_(!params.hemisphere && !params.host_drives_coils) {}

    /// Performs the due action: open, hello, start or time-out. Call it at least every few milliseconds.
    SessionEvent service(HostTime now);

    /// Processes one message. After an event `column` or `pose`, column() or pose() returns the content. Its time and the
    /// sequence of poses go on when the device starts again or its clock jumps, which starts it again.
    SessionEvent take(const hal::ReceivedMessage& message);

    /// Reports that the port is lost. service() opens it again.
    void on_device_lost(HostTime now);

    /// Sends the new excitation state of the host's coils to the device. Columns must echo `sequence`, which starts at 1.
    void note_excitation(Excitation state, std::uint32_t sequence);

    /// Sends the direction to the half space of a sensor to a tracker board; zero: unknown. The command is not repeated.
    void set_hemisphere(std::uint8_t sensor, const Vec3<double>& towards);

    /// Resets the device's watchdog and acknowledges the newest message.
    void keep_alive(HostTime now);

    /// True if the first column of a window arrived since the last call, also if it was refused: the coils may be switched.
    bool take_window_over() { return std::exchange(window_over_, false); }

    /// Stops the device, coils off, and ends the session.
    void stop();

    /// Sends a command. Its answers carry `request`. Commands may be lost: repeat the command if no answer comes.
    void command(protocol::Opcode opcode, std::uint16_t request, std::uint32_t argument, Excitation state);

    [[nodiscard]] Phase phase() const { return phase_; }
    [[nodiscard]] const protocol::IdentifyMessage& identity() const { return identity_; }
    /// With the hemisphere of the device's parameters, if none was given.
    [[nodiscard]] const SessionParams& params() const { return params_; }
    /// Empty: not read, or the device has none.
    [[nodiscard]] const std::optional<protocol::ParametersMessage>& parameters() const { return parameters_; }
    /// The newest status of the device.
    [[nodiscard]] const std::optional<protocol::StatusMessage>& device_status() const { return status_; }
    [[nodiscard]] bool has_identity() const { return has_identity_; }
    [[nodiscard]] bool is_tracker_board() const { return identity_.role == static_cast<std::uint8_t>(protocol::Role::tracker); }
    /// True if the device has been running for kSteady.
    [[nodiscard]] bool is_steady() const { return phase_ == Phase::running && heard_ - started_ >= kSteady; }
    [[nodiscard]] const MeasuredColumn<double>& column() const { return column_; }
    [[nodiscard]] const tracking::PoseEstimate<double>& pose() const { return pose_; }
    [[nodiscard]] const SessionCounters& counters() const { return counters_; }
    [[nodiscard]] const protocol::WireCounters& refused() const { return refused_; }
    [[nodiscard]] const protocol::ClockMap& clock_map() const { return clock_map_; }
    /// Reason why there is no session; empty during a session.
    [[nodiscard]] const char* detail() const { return reason_.c_str(); }

private:
    struct SentState {
        std::uint32_t sequence = 0;
        Excitation state = Excitation::off;
    };

    void begin_handshake(HostTime now);
    void pause_before_next_try();
    void request_start();
    void send_command(protocol::Opcode opcode, std::uint32_t argument, Excitation state = Excitation::off) {
        command(opcode, ++request_, argument, state);
    }
    template <typename Message>
    SessionEvent decode_and(SessionEvent (DeviceSession::*handler)(const Message&), const hal::ReceivedMessage& message);
    SessionEvent take_identity(const protocol::IdentifyMessage& identity);
    SessionEvent take_column(const protocol::ColumnMessage& received);
    SessionEvent take_pose(const protocol::PoseMessage& received);
    SessionEvent take_ack(const protocol::AckMessage& ack);
    SessionEvent take_status(const protocol::StatusMessage& status);
    SessionEvent take_parameters(const protocol::ParametersMessage& m);
    bool in_order(protocol::SequenceCheck& check, std::uint32_t sequence, std::uint64_t& lost);
    /// Moves the time of a column or pose; false: refused. is_late: it may be older than the newest.
    bool in_time(std::int64_t& time_us, bool is_late);
    [[nodiscard]] bool was_excited(const Column<double>& column) const;
    SessionEvent refuse(protocol::WireError error);
    SessionEvent refuse_column(protocol::WireError error, std::uint8_t sensor);

    hal::MessagePort& port_;
    SessionParams params_;
    bool reads_parameters_;
    std::optional<protocol::ParametersMessage> parameters_;
    Phase phase_ = Phase::closed;
    HostTime due_;       // time of the next try to open, identify or start
    HostTime heard_;     // last valid message; while running: last accepted column or pose
    HostTime conflict_;  // two devices answered on one address; valid until this time
    HostTime now_;
    HostTime arrival_;  // of the message that is taken
    HostTime fed_;
    HostTime started_;
    Microseconds pause_;  // before the next try; grows
    std::uint32_t command_sequence_ = 0;
    std::uint16_t request_ = 0;
    std::uint16_t starts_asked_ = 0;    // requests since the device was identified
    std::uint8_t hemispheres_set_ = 0;  // number of sensors whose hemisphere the device has acknowledged since then
    std::uint64_t other_versions_ = 0;  // refused messages of another protocol version, at the last hello
    bool has_tracked_ = false;          // a tracker board has sent a valid pose
    protocol::IdentifyMessage identity_;
    bool has_identity_ = false;
    bool window_over_ = false;
    std::array<bool, tracking::kMaxSensors> after_gap_{};  // columns were lost or refused since the sensor's last one
    std::int64_t window_us_ = -1;                          // device time of the newest column's window; -1: none yet
    std::optional<protocol::StatusMessage> status_;
    MeasuredColumn<double> column_;
    tracking::PoseEstimate<double> pose_;
    protocol::SequenceCheck columns_;
    protocol::SequenceCheck poses_;
    ContinuedClock clock_;
    host::ContinuedSequence pose_sequence_;
    protocol::ClockMap clock_map_;
    std::array<SentState, 4> sent_states_{};
    std::size_t newest_sent_ = 0;
    std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes_{};
    SessionCounters counters_;
    protocol::WireCounters refused_;
    drivers::Text reason_;
};

}  // namespace tricoil::linux_board
