// A conversation with one front end or tracker board: find it, agree on a version, start it, keep it fed, and begin again by
// itself whenever it falls silent or goes away. Nothing that it says is trusted before it has been checked. No heap after
// construction.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "core/protocol/clock_map.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/sequence_check.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "drivers/posix/text.hpp"
#include "hal/message_port.hpp"

namespace tricoil::linux_board {

struct SessionParams {
    std::uint64_t serial = 0;  // the device that it must be; 0: any
    bool host_drives_coils = false;
    bool start = true;       // false: ask who it is, and leave it alone
    bool any_coils = false;  // whoever drives the coils is right
};

enum class Phase : std::uint8_t { closed, greeting, starting, running };

enum class SessionEvent : std::uint8_t { none, identified, started, column, pose };

struct SessionCounters {
    std::uint64_t columns = 0;
    std::uint64_t poses = 0;
    std::uint64_t lost_columns = 0;  // gaps in the sequence
    std::uint64_t lost_poses = 0;
    std::uint64_t starts = 0;    // times that a device was started
    std::uint64_t silences = 0;  // times that it was given up
};

/// After a device that fails, the next try waits: 0.1 s, twice as long each time, kLongestPauseUs at most, until it has been
/// steady.
class DeviceSession {
public:
    static constexpr std::int64_t kSteadyUs = 2'000'000;
    static constexpr std::int64_t kLongestPauseUs = 10'000'000;

    DeviceSession(hal::MessagePort& port, const SessionParams& params) : port_(port), params_(params) {}

    /// Opens, greets, starts, gives up: whatever is due. Call it at least every few milliseconds.
    SessionEvent service(std::int64_t now_us);

    /// Takes one message; for a column or a pose the event says so and column() or pose() holds it.
    SessionEvent take(const hal::ReceivedMessage& message);

    /// The port is gone; service() will look for it again.
    void on_device_lost(std::int64_t now_us);

    /// Tells the device that the host has switched the coils; columns must echo this. Sequence counts from 1 after each start.
    void excited(Excitation state, std::uint32_t sequence);

    /// Feeds the device's watchdog, and tells it how far the host has come.
    void keep_alive(std::int64_t now_us);

    /// Whether the first column of a window has come since the last call, be it of use or not: time to switch the coils.
    bool take_window_over() { return std::exchange(window_over_, false); }

    /// Coils off; the conversation is over.
    void stop();

    /// Any command; answers that carry `request` belong to it. It may get lost: whoever needs an answer asks again.
    void command(protocol::Opcode opcode, std::uint16_t request, std::uint32_t argument, Excitation state);

    [[nodiscard]] Phase phase() const { return phase_; }
    [[nodiscard]] const protocol::IdentifyMessage& identity() const { return identity_; }
    [[nodiscard]] const protocol::StatusMessage& device_status() const { return status_; }
    [[nodiscard]] bool has_identity() const { return has_identity_; }
    /// Whether the device has been running for kSteadyUs: what went wrong before is over.
    [[nodiscard]] bool is_steady() const { return phase_ == Phase::running && heard_us_ - started_us_ >= kSteadyUs; }
    [[nodiscard]] const Column<double>& column() const { return column_; }
    [[nodiscard]] const tracking::PoseEstimate<double>& pose() const { return pose_; }
    [[nodiscard]] const protocol::PoseMessage& pose_message() const { return pose_message_; }
    [[nodiscard]] const SessionCounters& counters() const { return counters_; }
    [[nodiscard]] const protocol::WireCounters& refused() const { return refused_; }
    [[nodiscard]] const protocol::ClockMap& clock_map() const { return clock_map_; }
    /// Why there is no conversation; empty while there is one.
    [[nodiscard]] const char* detail() const { return why_.c_str(); }

private:
    struct Excited {
        std::uint32_t sequence = 0;
        Excitation state = Excitation::off;
    };

    void begin_greeting(std::int64_t now_us);
    void pause_before_next_try();
    void tell(protocol::Opcode opcode, std::uint32_t argument, Excitation state = Excitation::off) {
        command(opcode, ++request_, argument, state);
    }
    SessionEvent take_identity(const hal::ReceivedMessage& message);
    SessionEvent take_column(const hal::ReceivedMessage& message);
    SessionEvent take_pose(const hal::ReceivedMessage& message);
    SessionEvent take_ack(const hal::ReceivedMessage& message);
    bool in_order(protocol::SequenceCheck& check, std::uint32_t sequence, std::uint64_t& lost);
    [[nodiscard]] bool was_excited(const Column<double>& column) const;
    SessionEvent refuse(protocol::WireError error);

    hal::MessagePort& port_;
    SessionParams params_;
    Phase phase_ = Phase::closed;
    std::int64_t due_us_ = 0;       // of the next try to open, greet or start
    std::int64_t heard_us_ = 0;     // last message that was right; while running: column or pose that was taken
    std::int64_t conflict_us_ = 0;  // until then two devices have answered to one address
    std::int64_t now_us_ = 0;
    std::int64_t fed_us_ = 0;
    std::int64_t started_us_ = 0;
    std::int64_t pause_us_ = 0;  // before the next try; grows
    std::uint32_t command_sequence_ = 0;
    std::uint16_t request_ = 0;
    std::uint16_t starts_asked_ = 0;  // since the device was identified: the newest requests
    protocol::IdentifyMessage identity_;
    bool has_identity_ = false;
    bool window_over_ = false;
    std::int64_t window_us_ = -1;  // device time of the newest column's window; -1: none yet
    protocol::StatusMessage status_;
    Column<double> column_;
    tracking::PoseEstimate<double> pose_;
    protocol::PoseMessage pose_message_;
    protocol::SequenceCheck columns_;
    protocol::SequenceCheck poses_;
    protocol::ClockMap clock_map_;
    std::array<Excited, 4> excited_{};
    std::size_t newest_excited_ = 0;
    std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes_{};
    SessionCounters counters_;
    protocol::WireCounters refused_;
    drivers::Text why_;
};

}  // namespace tricoil::linux_board
