#include "board/linux/device_source.hpp"

#include "board/linux/device_uri.hpp"
#include "board/support/errors.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kLongestGap{1'000'000};  // between poses; longer: the device started again

DeviceLoopParams make_params(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                             tracking::TrackerTap<double>* tap, const host::ToolTips& tips) {
    DeviceLoopParams params = loop_params(config, calibration);
    params.tap = tap;
    params.tips = tips;
    return params;
}

/// Status of a connection without errors.
const char* to_text(Phase phase) {
    switch (phase) {
        case Phase::closed:
            return "not connected yet; poll for poses";
        case Phase::greeting:
            return "waiting for the device's identification";
        case Phase::starting:
            return "waiting for the device to start";
        case Phase::running:
            break;
    }
    return "running";
}

}  // namespace

DeviceSource::DeviceSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                           tracking::TrackerTap<double>* tap, const host::ToolTips& tips)
    : lines_(config.coils),
      port_(make_port(parse_device_uri(config.device))),
      loop_(*port_, lines_.lines(), make_params(config, calibration, tap, tips),
            [this](const tracking::PoseEstimate<double>& pose) { take(pose); }) {}

DeviceSource::~DeviceSource() {
    loop_.stop();
    port_->close();
}

void DeviceSource::take(const tracking::PoseEstimate<double>& pose) {
    const Microseconds step = pose.time - newest_.value_or(pose.time);
    elapsed_ += step.count() > 0 && step < kLongestGap ? step : Microseconds{};
    newest_ = pose.time;
    constexpr auto kHemisphereUnknown = tracking::PoseFlag::hemisphere_unknown;
    user_flags_ = {};
    user_flags_.set_if(pose.flags.has(kHemisphereUnknown), kHemisphereUnknown);
}

bool DeviceSource::advance(Microseconds patience) {
    loop_.step(patience);
    if (loop_.counters().lines_lost > 0) {
        throw host::DeviceError("the coil lines are lost (they were off); check the GPIO chip, then start again");
    }
    return true;
}

bool DeviceSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    loop_.set_hemisphere(sensor, towards);
    return true;
}

std::optional<host::LinkState> DeviceSource::link_state() const {
    const DeviceSession& session = loop_.session();
    const HostTime now = drivers::host_now();
    host::HealthCounts counts;
    counts.received = session.counters().columns + session.counters().poses - loop_.counters().rejected_columns;
    counts.lost = session.counters().lost_columns + session.counters().lost_poses;
    counts.refused = session.counters().refused + loop_.counters().rejected_columns;
    counts.dropped = port_->counters().send_queue_full + port_->counters().receive_dropped + session.counters().dropped;
    counts.age = loop_.newest() ? now - *loop_.newest() : Microseconds{};
    const auto& status = session.device_status();
    if (status && (status->supply_mv != 0 || status->temperature_cdeg != 0)) {  // both zero: the device does not measure them
        counts.temperature_c = 0.01 * status->temperature_cdeg;
    }
    return host::LinkState{counts, now - HostTime{}};
}

std::string DeviceSource::status() const {
    const char* const error = loop_.session().detail();
    return *error != '\0' ? error : to_text(loop_.session().phase());
}

}  // namespace tricoil::linux_board
