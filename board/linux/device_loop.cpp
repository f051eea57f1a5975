#include "board/linux/device_loop.hpp"

#include <algorithm>
#include <utility>

#include "board/linux/column_correction.hpp"
#include "board/linux/column_timing.hpp"
#include "core/protocol/convert.hpp"
#include "core/tracking/hemisphere.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kWait{5000};
constexpr Microseconds kSyncWait{200};             // short, so that the wait for messages does not delay an edge
constexpr int kMaxEdges = 16;                      // per step; size of the kernel's queue
constexpr int kMaxMessagesPerStep = 256;           // per step, so that a flood does not delay signals and time-outs
constexpr Microseconds kHemispherePause{100'000};  // between commands to a tracker board, which answers with its next poses
constexpr Microseconds kColumnSilence{150'000};    // longest time without a column before poses are flagged stale

}  // namespace

DeviceLoop::DeviceLoop(hal::MessagePort& port, HostLines lines, const DeviceLoopParams& params, tracking::TrackerTap<double>& tap,
                       PoseSink sink)
    : port_(port), lines_(lines), params_(params), tap_(tap), sink_(std::move(sink)), session_(port, params.session) {
    switch_off();
}

DeviceLoop::~DeviceLoop() { stop(); }

void DeviceLoop::stop() {
    newest_.reset();
    switch_off();
    session_.stop();
}

void DeviceLoop::switch_off() {
    if (lines_.coils != nullptr) {
        lines_.coils->switch_off();
    }
}

void DeviceLoop::step(Microseconds longest_wait) {
    const HostTime now = drivers::host_now();
    (void)session_.service(now);
    follow_phase();
    if (session_.phase() == Phase::closed) {
        timespec pause{0, static_cast<long>(std::min(kWait, longest_wait).count()) * 1000};
        ::nanosleep(&pause, nullptr);
        return;
    }
    Status status = port_.wait(std::min(lines_.sync != nullptr ? kSyncWait : kWait, longest_wait));
    bool any = false;
    for (int n = 0; n < kMaxMessagesPerStep && status.code() != StatusCode::device_lost; ++n) {
        hal::ReceivedMessage message;
        status = port_.receive(message);
        if (!status.ok()) {
            break;
        }
        take(message);
        follow_phase();
        any = true;
    }
    follow_sync();
    if (any && session_.phase() == Phase::running && lines_.coils == nullptr) {
        session_.keep_alive(drivers::host_now());
    }
    if (status.code() == StatusCode::device_lost) {
        session_.on_device_lost(now);
        follow_phase();
    }
    tick(now);
}

/// Switches the coils off when the session ends.
void DeviceLoop::follow_phase() {
    const bool running = session_.phase() == Phase::running;
    if (was_running_ && !running) {
        switch_off();
    }
    was_running_ = running;
}

void DeviceLoop::take(const hal::ReceivedMessage& message) {
    switch (session_.take(message)) {
        case SessionEvent::started:
            begin();
            break;
        case SessionEvent::column:
            track(message);
            break;
        case SessionEvent::pose:
            take_pose(message.arrival);
            break;
        default:
            break;
    }
    if (session_.take_window_over() && lines_.sync == nullptr) {
        next_state();
    }
}

void DeviceLoop::begin() {
    is_tdm_ = session_.identity().multiplexing == 0;
    const auto& identity = session_.identity();
    params_.session = session_.params();
    params_.hemisphere = params_.session.hemisphere.value_or(params_.hemisphere);
    auto settings = tracker_settings(params_, identity.sensors, static_cast<signal::Multiplexing>(identity.multiplexing),
                                     1e-3 * identity.frame_rate_millihertz);
    settings.tracker.common.window_s = 1e-6 * identity.window_us;
    for (std::size_t n = 0; n < std::min<std::size_t>(identity.sensors, trackers_.size()); ++n) {
        trackers_[n].emplace(settings.tracker, settings.calibration);
        sequences_[n].begin();
    }
    tap_.begin(settings);
    for (std::size_t n = 0; n < restorers_.size() && !session_.is_tracker_board() && !params_.session.confined; ++n) {
        if (restorers_[n].has_tracked()) {
            set_hemisphere(n, Vec3<double>::Zero());
        }
    }
    for (std::size_t n = 0; n < wanted_hemisphere_.size(); ++n) {
        if (const auto towards = std::exchange(wanted_hemisphere_[n], std::nullopt)) {
            set_hemisphere(n, *towards);
        }
    }
    state_sequence_ = 0;
    newest_ = drivers::host_now();
    column_time_.reset();
    sensor_times_ = {};
    take_edges();  // discards old edges
    (void)session_.take_window_over();
    beat();
    next_state();
}

/// A pose of a tracker board.
void DeviceLoop::take_pose(HostTime arrival) {
    const tracking::PoseEstimate<double>& pose = session_.pose();
    tap_.pose(pose);
    deliver(params_.tips.at_tip(pose), pose.valid(), arrival);
    const HostTime now = drivers::host_now();
    newest_ = now;
    std::optional<Vec3<double>> side = restorers_[pose.sensor].side(pose, now);
    if (params_.session.confined && HemisphereRestorer::lacks_only_hemisphere(pose)) {
        side = params_.session.hemisphere;
    }
    if (side && now - hemisphere_sent_[pose.sensor] > kHemispherePause) {
        hemisphere_sent_[pose.sensor] = now;
        ++counters_.hemispheres_restored;
        set_hemisphere(pose.sensor, *side);
    }
}

/// Toggles the heartbeat at the start of the measurement, and then for each accepted column.
void DeviceLoop::beat() {
    if (lines_.heartbeat != nullptr) {
        (void)lines_.heartbeat->beat();  // if the line is lost, the enable drops, which is safe
    }
}

void DeviceLoop::next_state() {
    if (lines_.coils == nullptr || session_.phase() != Phase::running) {
        return;
    }
    const Excitation state = is_tdm_ ? single_coil(static_cast<int>(state_sequence_ % kSourceCoils)) : Excitation::all;
    if (!lines_.coils->excite(state).ok()) {
        ++counters_.lines_lost;
        return;
    }
    ++counters_.excitations;
    session_.note_excitation(state, ++state_sequence_);
}

void DeviceLoop::follow_sync() {
    for (int edges = take_edges(); edges > 0; --edges) {
        ++counters_.sync_edges;
        next_state();
    }
}

/// Number of new edges, limited so that a noisy line does not block the loop.
int DeviceLoop::take_edges() {
    int edges = 0;
    HostTime edge;
    while (lines_.sync != nullptr && edges < kMaxEdges && lines_.sync->next_edge(edge).ok()) {
        ++edges;
    }
    return edges;
}

void DeviceLoop::track(const hal::ReceivedMessage& message) {
    const MeasuredColumn<double>& sent = session_.column();  // of channels, as the errors of the converters are
    const MeasuredColumn<double> column =
        params_.wiring.of_coils(params_.calibration ? corrected(sent, params_.calibration->converters) : sent);
    column_time_ = drivers::host_now();
    beat();
    if (column.sensor >= trackers_.size() || !trackers_[column.sensor]) {
        return;
    }
    sensor_times_[column.sensor] = column_time_;
    tap_.column(column);
    tracking::AnyTracker& tracker = *trackers_[column.sensor];
    const std::uint64_t accepted = tracker.counters().accepted;
    auto estimate = tracker.update(column);
    if (tracker.counters().accepted > accepted) {
        newest_ = column_time_;
    } else if (!column.flags.has(ColumnFlag::low_band)) {  // trackers do not count the low band
        ++counters_.rejected_columns;
    }
    if (estimate) {
        answer(*estimate, estimate->valid(), message.arrival);
        if (const auto side = restorers_[column.sensor].side(*estimate, *column_time_)) {
            ++counters_.hemispheres_restored;
            set_hemisphere(column.sensor, *side);
        }
    }
}

/// Delivers a pose of a tracker of this host.
void DeviceLoop::answer(tracking::PoseEstimate<double>& estimate, bool valid, HostTime received) {
    estimate.sequence = sequences_[estimate.sensor].next(estimate.sequence);
    tap_.pose(estimate);
    deliver(params_.tips.at_tip(estimate), valid, received);
}

void DeviceLoop::deliver(const tracking::PoseEstimate<double>& pose, bool valid, HostTime received) {
    ++counters_.poses;
    counters_.valid_poses += valid ? 1U : 0U;
    latency_.add((drivers::host_now() - received).count());
    sink_(pose);
    if (params_.publish && !session_.is_tracker_board()) {
        protocol::PoseMessage published = protocol::to_message(pose);
        published.sequence = pose_sequence_++;
        const std::size_t size = protocol::encode(published, bytes_);
        counters_.unpublished += port_.send(std::span(bytes_).first(size)).ok() ? 0U : 1U;
    }
}

/// During silence of a sensor, delivers its last pose, flagged stale.
void DeviceLoop::tick(HostTime host_now) {
    if (session_.phase() != Phase::running || !column_time_) {
        return;
    }
    const DeviceTime now = session_.column().midpoint + (host_now - *column_time_);
    for (std::size_t n = 0; n < trackers_.size(); ++n) {
        if (!trackers_[n] || !sensor_times_[n] || host_now - *sensor_times_[n] < kColumnSilence) {
            continue;
        }
        tap_.tick(static_cast<std::uint8_t>(n), now);
        if (auto estimate = trackers_[n]->tick(now)) {
            answer(*estimate, false, host_now);
        }
    }
}

void DeviceLoop::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    if (sensor >= trackers_.size() || !tracking::is_hemisphere(towards)) {
        return;
    }
    if (session_.phase() != Phase::running) {
        wanted_hemisphere_[sensor] = towards;
        return;
    }
    if (sensor >= session_.identity().sensors) {
        return;
    }
    if (session_.is_tracker_board()) {
        session_.set_hemisphere(static_cast<std::uint8_t>(sensor), towards);
        return;
    }
    tap_.hemisphere(static_cast<std::uint8_t>(sensor), towards);
    (void)trackers_[sensor]->set_hemisphere(towards);
}

}  // namespace tricoil::linux_board
