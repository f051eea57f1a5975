#include "board/host/smooth/smoothing_tap.hpp"

namespace tricoil::host {

TrackerSettings for_smoothing(TrackerSettings settings) {
    if (auto* bands = std::get_if<tracking::DualBandParams>(&settings.tracker.method)) {
        bands->filter = true;
        bands->predict_ahead = Microseconds{0};
        return settings;
    }
    if (!std::holds_alternative<tracking::ScaatParams<double>>(settings.tracker.method)) {
        settings.tracker.method = tracking::ScaatParams<double>{};
    }
    std::get<tracking::ScaatParams<double>>(settings.tracker.method).predict_ahead = Microseconds{0};
    return settings;
}

void SmoothingTap::finish() {
    for (const auto& sensor : sensors_) {
        sensor->smoother.finish(sensor->tracker);
    }
}

void SmoothingTap::do_begin(const Settings& settings) {
    finish();
    sensors_.clear();
    const TrackerSettings own = for_smoothing(settings);
    for (int n = 0; n < settings.sensors; ++n) {
        sensors_.push_back(std::make_unique<Sensor>(own.tracker, own.calibration, receiver_));
    }
}

void SmoothingTap::do_column(const MeasuredColumn<double>& column) {
    Sensor& sensor = *sensors_.at(column.sensor);
    if (const auto estimate = sensor.tracker.update(column)) {
        sensor.smoother.add(*estimate, sensor.tracker);
    }
}

/// A pose from tick() contains no new column, so it is not smoothed.
void SmoothingTap::do_tick(std::uint8_t sensor, DeviceTime now) { (void)sensors_.at(sensor)->tracker.tick(now); }

void SmoothingTap::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    (void)sensors_.at(sensor)->tracker.set_hemisphere(towards);  // a refused hemisphere is refused again
}

}  // namespace tricoil::host
