#include "board/pose_source/device_source.hpp"

#include "board/linux/device_uri.hpp"
#include "board/support/calibration_file.hpp"

namespace tricoil::host {
namespace {

linux_board::DeviceLoopParams make_params(const linux_board::DeviceConfig& config, PoseQueue& queue) {
    const auto calibration =
        config.calibration.empty() ? std::nullopt : std::optional(read_calibration(config.calibration).calibration);
    linux_board::DeviceLoopParams params = linux_board::loop_params(config, calibration);
    params.tap = &queue;
    return params;
}

/// Status of a connection without errors.
const char* to_text(linux_board::Phase phase) {
    switch (phase) {
        case linux_board::Phase::closed:
            return "not connected yet; poll for poses";
        case linux_board::Phase::greeting:
            return "waiting for the device's identification";
        case linux_board::Phase::starting:
            return "waiting for the device to start";
        case linux_board::Phase::running:
            break;
    }
    return "running";
}

}  // namespace

DeviceSource::DeviceSource(const linux_board::DeviceConfig& config)
    : lines_(config.coils),
      port_(linux_board::make_port(linux_board::parse_device_uri(config.device))),
      loop_(*port_, lines_.lines(), make_params(config, queue()), [](const tracking::PoseEstimate<double>&) {}) {}

DeviceSource::~DeviceSource() {
    loop_.stop();
    port_->close();
}

bool DeviceSource::do_advance(Microseconds patience) {
    loop_.step(patience);
    return true;
}

bool DeviceSource::do_set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    loop_.set_hemisphere(sensor, towards);
    return true;
}

std::string DeviceSource::do_status() const {
    const linux_board::DeviceSession& session = loop_.session();
    const char* const error = session.detail();
    return *error != '\0' ? error : to_text(session.phase());
}

}  // namespace tricoil::host
