#include "board/host/smooth/smoothing_tap.hpp"

#include "board/support/tracker_choice.hpp"

namespace tricoil::host {

TrackerSettings for_smoothing(TrackerSettings settings) {
    if (!estimates_velocity(settings.tracker.method)) {
        settings.tracker.method = tracking::ScaatParams<double>{};
    }
    set_prediction(settings.tracker.method, Microseconds{0});
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
