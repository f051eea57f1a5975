#include "board/linux/device_session.hpp"

#include <algorithm>
#include <cinttypes>

#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "core/protocol/negotiation.hpp"

namespace tricoil::linux_board {
namespace {

using protocol::MessageType;
using protocol::Opcode;
using protocol::WireError;

constexpr Microseconds kOpenPause{100'000};
constexpr Microseconds kGreetPause{100'000};
constexpr Microseconds kSilence{500'000};
constexpr Microseconds kConflict{1'000'000};
constexpr Microseconds kFeed{20'000};  // longest interval between keep_alive messages
constexpr std::uint16_t kProduct = 1;
constexpr int kParameterRequests = 3;  // a device may ignore a command that it does not know

bool sends_columns(const protocol::IdentifyMessage& identity) {
    return identity.role == static_cast<std::uint8_t>(protocol::Role::front_end);
}

/// Reason why the tracker for two bands cannot use this device; null: it can.
const char* lacks_two_bands(const protocol::IdentifyMessage& identity) {
    if (!sends_columns(identity) || identity.multiplexing != static_cast<std::uint8_t>(signal::Multiplexing::dual_band)) {
        return "the device does not send columns of two bands; use 'tricoil device mode DEVICE --mux dual-band --columns'";
    }
    if (tracking::dual_band_params(1e3 / identity.frame_rate_millihertz).window_frames == 0) {
        return "no 0.1, 0.2, ... s hold a whole number of the device's frames, at most 64; use 'tricoil device mode DEVICE --mux "
               "dual-band --columns'";
    }
    return nullptr;
}

}  // namespace

void DeviceSession::command(Opcode opcode, std::uint16_t request, std::uint32_t argument, Excitation state) {
    protocol::CommandMessage m;
    m.sequence = command_sequence_++;
    m.time_us = to_us(now_);
    m.opcode = static_cast<std::uint8_t>(opcode);
    m.state = static_cast<std::uint8_t>(state);
    m.request = request;
    m.argument = argument;
    const std::size_t size = protocol::encode(m, bytes_);
    // The port counts failures. Every message is repeated or has a time-out, except the hemisphere command while running.
    (void)port_.send(std::span(bytes_).first(size));
}

SessionEvent DeviceSession::service(HostTime now) {
    now_ = now;
    if (phase_ == Phase::running && now - heard_ > kSilence) {
        ++counters_.silences;
        begin_handshake(now);
        pause_before_next_try();
        reason_.print("no valid messages from the device");
        return SessionEvent::none;
    }
    if (phase_ == Phase::running) {
        pause_ = is_steady() ? Microseconds{} : pause_;
        if (now - fed_ > kFeed) {
            keep_alive(now);
        }
        return SessionEvent::none;
    }
    if (now < due_) {
        return SessionEvent::none;
    }
    due_ = now + kGreetPause;
    if (phase_ == Phase::closed) {
        if (!port_.open().ok()) {
            reason_.print("%s", port_.detail());
            due_ = now + kOpenPause;
            return SessionEvent::none;
        }
        begin_handshake(now);
    }
    if (phase_ == Phase::starting && now - heard_ < kSilence) {
        request_start();
    } else {
        phase_ = Phase::greeting;
        const std::uint64_t others = refused_.of(WireError::unknown_version) + port_.wire_errors().of(WireError::unknown_version);
        if (std::exchange(other_versions_, others) < others) {
            reason_.print("the device uses another protocol version, this program %u to %u; update the older one",
                          protocol::kOldestVersion, protocol::kNewestVersion);
        }
        send_command(Opcode::hello, protocol::hello_argument({}));
    }
    return SessionEvent::none;
}

/// Sends start. First the parameters are read, and a tracker board gets the hemisphere of each sensor, the next one after an
/// acknowledgement.
void DeviceSession::request_start() {
    if (++starts_asked_ <= kParameterRequests && reads_parameters_ && !parameters_) {
        send_command(Opcode::read_parameters, 0);
        return;
    }
    const auto hemisphere = has_tracked_ && !params_.confined ? Vec3<double>(Vec3<double>::Zero()) : params_.hemisphere;
    if (is_tracker_board() && hemisphere && hemispheres_set_ < identity_.sensors) {
        set_hemisphere(hemispheres_set_, *hemisphere);
    } else {
        send_command(Opcode::start, params_.host_drives_coils ? 1 : 0);
    }
}

void DeviceSession::begin_handshake(HostTime now) {
    if (phase_ == Phase::running) {
        send_command(Opcode::stop, 0);
    }
    phase_ = Phase::greeting;
    has_identity_ = false;
    due_ = now;
    reason_.print("no answer yet");
}

void DeviceSession::pause_before_next_try() {
    pause_ = std::clamp(2 * pause_, kGreetPause, kLongestPause);
    due_ = now_ + pause_;
}

void DeviceSession::on_device_lost(HostTime now) {
    counters_.silences += phase_ == Phase::running ? 1U : 0U;
    phase_ = Phase::closed;
    has_identity_ = false;
    reason_.print("%s", port_.detail());
    due_ = now + kOpenPause;
}

void DeviceSession::note_excitation(Excitation state, std::uint32_t sequence) {
    newest_sent_ = (newest_sent_ + 1) % sent_states_.size();
    sent_states_[newest_sent_] = {sequence, state};
    send_command(Opcode::excite, sequence, state);
    fed_ = now_;
}

void DeviceSession::set_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    const double largest = towards.cwiseAbs().maxCoeff();
    const Vec3<double> direction = largest > 0 ? Vec3<double>(towards / largest) : Vec3<double>(Vec3<double>::Zero());
    send_command(Opcode::hemisphere, protocol::hemisphere_argument({sensor, direction.cast<float>()}));
}

void DeviceSession::keep_alive(HostTime now) {
    now_ = now;
    fed_ = now;
    const protocol::SequenceCheck& data = columns_.started() ? columns_ : poses_;
    send_command(Opcode::keep_alive, data.started() ? data.newest() : 0);
}

void DeviceSession::stop() {
    if (phase_ == Phase::starting || phase_ == Phase::running) {
        send_command(Opcode::stop, 0);
    }
    phase_ = Phase::closed;
}

SessionEvent DeviceSession::refuse(WireError error) {
    refused_.count(error);
    return SessionEvent::none;
}

SessionEvent DeviceSession::refuse_column(WireError error, std::uint8_t sensor) {
    after_gap_[sensor] = true;
    ++counters_.refused;
    return refuse(error);
}

SessionEvent DeviceSession::take(const hal::ReceivedMessage& message) {
    WireError error = WireError::none;
    const MessageType type = protocol::type_of(message.bytes, error);
    if (error != WireError::none) {
        return refuse(error);
    }
    arrival_ = message.arrival;
    now_ = std::max(now_, arrival_);
    switch (type) {
        case MessageType::identify:
            return decode_and(&DeviceSession::take_identity, message);
        case MessageType::ack:
            return decode_and(&DeviceSession::take_ack, message);
        case MessageType::column:
            return decode_and(&DeviceSession::take_column, message);
        case MessageType::pose:
            return decode_and(&DeviceSession::take_pose, message);
        case MessageType::status:
            return decode_and(&DeviceSession::take_status, message);
        case MessageType::parameters:
            return decode_and(&DeviceSession::take_parameters, message);
        case MessageType::command:
            return refuse(WireError::wrong_sender);
        default:
            return SessionEvent::none;  // valid, but not used here
    }
}

template <typename Message>
SessionEvent DeviceSession::decode_and(SessionEvent (DeviceSession::*handler)(const Message&),
                                       const hal::ReceivedMessage& message) {
    Message decoded;
    const WireError error = protocol::decode(message.bytes, decoded);
    return error == WireError::none ? (this->*handler)(decoded) : refuse(error);
}

SessionEvent DeviceSession::take_status(const protocol::StatusMessage& status) {
    const bool dropped_more = status_ && status.dropped > status_->dropped;  // fewer: the device has restarted
    counters_.dropped += dropped_more ? status.dropped - status_->dropped : 0U;
    status_ = status;
    heard_ = phase_ == Phase::running ? heard_ : now_;  // a running device must also send columns or poses
    return SessionEvent::none;
}

SessionEvent DeviceSession::take_parameters(const protocol::ParametersMessage& m) {
    if (phase_ == Phase::starting && reads_parameters_) {
        const Vec3<float> towards = protocol::hemisphere_of_argument(m.values[protocol::kHemisphere]).towards;
        params_.hemisphere.reset();
        if (!towards.isZero(0)) {
            params_.hemisphere = towards.cast<double>();
        }
        params_.confined = params_.hemisphere && m.values[protocol::kConfined] != 0;
        parameters_ = m;
        due_ = now_;
    }
    return SessionEvent::none;
}

SessionEvent DeviceSession::take_identity(const protocol::IdentifyMessage& identity) {
    if (has_identity_ && identity.serial != identity_.serial) {
        conflict_ = now_ + kConflict;
        begin_handshake(now_);
        due_ = conflict_;
        reason_.print("devices %" PRIu64 " and %" PRIu64 " answer to one address; give one of them another node number",
                      identity_.serial, identity.serial);
        return refuse(WireError::duplicate_node);
    }
    if (identity.product != kProduct) {
        reason_.print("unknown product %u; disconnect the device, or choose another node", identity.product);
        return refuse(WireError::impossible);
    }
    if (protocol::common_version({identity.oldest_version, identity.newest_version}, {}) == 0) {
        reason_.print("the device supports protocol versions %u to %u, this program %u to %u; update the older one",
                      identity.oldest_version, identity.newest_version, protocol::kOldestVersion, protocol::kNewestVersion);
        return refuse(WireError::unknown_version);
    }
    if (params_.serial != 0 && identity.serial != params_.serial) {
        reason_.print("the device has serial number %" PRIu64 ", the configuration asks for %" PRIu64, identity.serial,
                      params_.serial);
        return refuse(WireError::wrong_sender);
    }
    if (!params_.any_coils && params_.host_drives_coils == (identity.drives_coils != 0)) {
        reason_.print(params_.host_drives_coils ? "the device drives the coils itself; remove [coils] from the configuration"
                                                : "the host must drive the coils; give their lines in [coils]");
        return refuse(WireError::wrong_sender);
    }
    if (const char* lacks = params_.dual_band ? lacks_two_bands(identity) : nullptr; lacks != nullptr) {
        reason_.print("%s", lacks);
        return refuse(WireError::wrong_sender);
    }
    if (params_.has_wiring && !sends_columns(identity)) {
        reason_.print("the device computes poses itself, so --wiring has no effect; use 'tricoil device mode DEVICE --columns'");
        return refuse(WireError::wrong_sender);
    }
    if (phase_ != Phase::greeting || now_ < conflict_) {
        return SessionEvent::none;
    }
    if (identity.serial != identity_.serial) {
        status_.reset();  // of another device
        parameters_.reset();
    }
    identity_ = identity;
    has_identity_ = true;
    heard_ = now_;
    reason_.clear();
    if (params_.start) {
        phase_ = Phase::starting;
        starts_asked_ = 0;
        hemispheres_set_ = 0;
        due_ = now_;
    }
    return SessionEvent::identified;
}

SessionEvent DeviceSession::take_ack(const protocol::AckMessage& ack) {
    if (ack.opcode == static_cast<std::uint8_t>(Opcode::read_parameters) && ack.request == request_) {
        reads_parameters_ = false;  // the device has none
        due_ = now_;
    }
    const bool is_hemisphere = ack.opcode == static_cast<std::uint8_t>(Opcode::hemisphere) && ack.request == request_;
    if (phase_ != Phase::starting || (ack.opcode != static_cast<std::uint8_t>(Opcode::start) && !is_hemisphere)) {
        return SessionEvent::none;
    }
    if (static_cast<std::uint16_t>(request_ - ack.request) >= starts_asked_) {
        return SessionEvent::none;  // answer to a request of another program
    }
    if (ack.result != 0) {
        reason_.print("the device refuses %s (%u)", is_hemisphere ? "the hemisphere" : "to start", ack.result);
        hemispheres_set_ = 0;  // the device may have forgotten them
        pause_before_next_try();
        return SessionEvent::none;
    }
    if (is_hemisphere) {
        ++hemispheres_set_;
        due_ = now_;
        return SessionEvent::none;
    }
    phase_ = Phase::running;
    heard_ = now_;
    started_ = now_;
    columns_.restart();
    poses_.restart();
    clock_.begin_session();
    pose_sequence_.begin();
    clock_map_ = {};
    sent_states_ = {};
    after_gap_ = {};
    window_us_ = -1;
    ++counters_.starts;
    return SessionEvent::started;
}

bool DeviceSession::in_order(protocol::SequenceCheck& check, std::uint32_t sequence, std::uint64_t& lost) {
    const std::uint64_t before = check.lost();
    const protocol::Order order = check.check(sequence);
    if (order == protocol::Order::old || order == protocol::Order::strange) {
        refused_.count(WireError::out_of_order);
        return false;
    }
    lost += check.lost() - before;
    return true;
}

bool DeviceSession::in_time(std::int64_t& time_us, bool is_late) {
    const ContinuedClock::Verdict verdict = clock_.take(time_us, arrival_, is_late);
    if (verdict == ContinuedClock::Verdict::jumped) {
        begin_handshake(now_);
        reason_.print("the device's clock jumped");
    }
    if (verdict != ContinuedClock::Verdict::good) {
        refused_.count(WireError::out_of_order);
        return false;
    }
    clock_map_.observe(device_time_us(time_us), arrival_);
    return true;
}

bool DeviceSession::was_excited(const Column<double>& column) const {
    return std::any_of(sent_states_.begin(), sent_states_.end(), [&](const SentState& e) {
        return e.sequence == column.state_sequence && (e.state == column.state || e.state == Excitation::all);
    });
}

SessionEvent DeviceSession::take_column(const protocol::ColumnMessage& received) {
    protocol::ColumnMessage m = received;
    if (phase_ != Phase::running || identity_.role != static_cast<std::uint8_t>(protocol::Role::front_end) ||
        m.sensor >= identity_.sensors) {
        return refuse(WireError::wrong_sender);
    }
    const std::uint64_t lost = counters_.lost_columns;
    if (!in_order(columns_, m.sequence, counters_.lost_columns)) {
        return SessionEvent::none;
    }
    if (counters_.lost_columns != lost) {
        after_gap_.fill(true);
    }
    if (m.time_us != window_us_) {  // columns of one window have one time
        window_us_ = m.time_us;
        window_over_ = true;
    }
    if (!in_time(m.time_us, ColumnFlags::of_bits(m.flags, {ColumnFlag::low_band}).has(ColumnFlag::low_band))) {
        after_gap_[m.sensor] = true;
        return SessionEvent::none;
    }
    if (const WireError error = protocol::from_message(m, column_); error != WireError::none) {
        return refuse_column(error, m.sensor);
    }
    if (params_.host_drives_coils && !was_excited(column_)) {
        return refuse_column(WireError::transition, m.sensor);
    }
    column_.flags.set_if(std::exchange(after_gap_[m.sensor], false), ColumnFlag::after_gap);
    heard_ = now_;
    ++counters_.columns;
    return SessionEvent::column;
}

SessionEvent DeviceSession::take_pose(const protocol::PoseMessage& received) {
    protocol::PoseMessage pose = received;
    if (phase_ != Phase::running || identity_.role != static_cast<std::uint8_t>(protocol::Role::tracker) ||
        pose.sensor >= identity_.sensors) {
        return refuse(WireError::wrong_sender);
    }
    if (!in_order(poses_, pose.sequence, counters_.lost_poses) || !in_time(pose.time_us, false)) {
        return SessionEvent::none;
    }
    pose.sequence = pose_sequence_.next(pose.sequence);
    if (const WireError error = protocol::from_message(pose, pose_); error != WireError::none) {
        ++counters_.refused;
        return refuse(error);
    }
    has_tracked_ = has_tracked_ || pose_.valid();
    heard_ = now_;
    ++counters_.poses;
    return SessionEvent::pose;
}

}  // namespace tricoil::linux_board
