#include "board/app/main_loop.hpp"

#include <algorithm>

namespace tricoil::app {

template <typename Scalar, typename SensorTracker, int Sensors>
MainLoop<Scalar, SensorTracker, Sensors>::MainLoop(const MainLoopParams<Scalar>& params, Devices<Scalar> devices)
    : plan_(params.plan), sensor_count_(params.sensors), devices_(devices) {
    devices_.coils.switch_off();
    for (int n = 0; n < std::min(sensor_count_, Sensors); ++n) {
        sensors_[static_cast<std::size_t>(n)].emplace(params);
    }
}

template <typename Scalar, typename SensorTracker, int Sensors>
MainLoop<Scalar, SensorTracker, Sensors>::~MainLoop() {
    stop();
}

template <typename Scalar, typename SensorTracker, int Sensors>
Status MainLoop<Scalar, SensorTracker, Sensors>::start() {
    if (sensor_count_ < 1 || sensor_count_ > Sensors) {
        return {StatusCode::invalid_argument, "number of sensors must be at least one, and no more than there is memory for"};
    }
    slot_ = 0;
    blocks_of_slot_ = 0;
    expected_sequence_ = 0;
    settling_blocks_ = plan_.is_tdm() ? 0 : sensor_count_;
    const Status status = devices_.sampler.start(plan_);
    if (!status.ok()) {
        stop();
    }
    return status;
}

template <typename Scalar, typename SensorTracker, int Sensors>
Status MainLoop<Scalar, SensorTracker, Sensors>::step() {
    const Status status = acquire();
    if (status.ok()) {
        process();
    }
    return status;
}

template <typename Scalar, typename SensorTracker, int Sensors>
Status MainLoop<Scalar, SensorTracker, Sensors>::acquire() {
    has_block_ = false;
    if (blocks_of_slot_ == 0) {
        if (const Status excited = devices_.coils.excite(next_state()); !excited.ok()) {
            stop();
            return excited;
        }
        ++slot_;
    }
    blocks_of_slot_ = (blocks_of_slot_ + 1) % sensor_count_;
    const Status polled = devices_.sampler.poll(block_);
    if (polled.code() == StatusCode::timed_out) {
        ++counters_.lost_blocks;
        ++expected_sequence_;
        for (std::size_t n = 0; n < sensors_.size(); ++n) {
            if (sensors_[n]) {
                tick(n);
            }
        }
        return polled;
    }
    if (!polled.ok()) {
        stop();
        return polled;
    }
    ++counters_.blocks;
    count_gap(block_.sequence);
    has_block_ = settling_blocks_ == 0;
    settling_blocks_ = std::max(settling_blocks_ - 1, 0);
    return {};
}

template <typename Scalar, typename SensorTracker, int Sensors>
void MainLoop<Scalar, SensorTracker, Sensors>::process() {
    if (!has_block_) {
        return;
    }
    if (block_.sensor >= sensors_.size() || !sensors_[block_.sensor]) {
        ++counters_.refused_blocks;
        return;
    }
    if (!track(*sensors_[block_.sensor])) {
        tick(block_.sensor);
    }
}

/// The block's columns and their poses; false if there was none. Its frame is off the stack again when tick() needs one as large.
template <typename Scalar, typename SensorTracker, int Sensors>
[[gnu::noinline]] bool MainLoop<Scalar, SensorTracker, Sensors>::track(Sensor& sensor) {
    const auto columns = sensor.demodulator.demodulate(block_);
    if (!columns.ok()) {
        ++counters_.refused_blocks;
        return false;
    }
    bool gave_pose = false;
    for (const Column<Scalar>& column : *columns) {
        if (devices_.tap != nullptr) {
            devices_.tap->column(column);
        }
        if (const auto estimate = sensor.tracker.update(column)) {
            send(*estimate);
            gave_pose = true;
        }
    }
    return gave_pose;
}

template <typename Scalar, typename SensorTracker, int Sensors>
void MainLoop<Scalar, SensorTracker, Sensors>::tick(std::size_t n) {
    const DeviceTime now = devices_.clock.now();
    if (devices_.tap != nullptr) {
        devices_.tap->tick(static_cast<std::uint8_t>(n), now);
    }
    if (const auto estimate = sensors_[n]->tracker.tick(now)) {
        send(*estimate);
    }
}

template <typename Scalar, typename SensorTracker, int Sensors>
Status MainLoop<Scalar, SensorTracker, Sensors>::set_hemisphere(std::size_t sensor, const Vec3<Scalar>& towards) {
    if (sensor >= sensors_.size() || !sensors_[sensor]) {
        return {StatusCode::invalid_argument, "no such sensor"};
    }
    if (devices_.tap != nullptr) {
        devices_.tap->hemisphere(static_cast<std::uint8_t>(sensor), towards);
    }
    return sensors_[sensor]->tracker.set_hemisphere(towards);
}

template <typename Scalar, typename SensorTracker, int Sensors>
void MainLoop<Scalar, SensorTracker, Sensors>::stop() {
    devices_.coils.switch_off();
    devices_.sampler.stop();
    has_block_ = false;
}

template <typename Scalar, typename SensorTracker, int Sensors>
Excitation MainLoop<Scalar, SensorTracker, Sensors>::next_state() const {
    return plan_.is_tdm() ? single_coil(slot_ % kSourceCoils) : Excitation::all;
}

template <typename Scalar, typename SensorTracker, int Sensors>
void MainLoop<Scalar, SensorTracker, Sensors>::count_gap(std::uint32_t sequence) {
    const auto gap = static_cast<std::int32_t>(sequence - expected_sequence_);  // wraps as the sequence does
    counters_.lost_blocks += gap > 0 ? static_cast<std::uint32_t>(gap) : 0U;
    expected_sequence_ = sequence + 1;
}

template <typename Scalar, typename SensorTracker, int Sensors>
void MainLoop<Scalar, SensorTracker, Sensors>::send(const tracking::PoseEstimate<Scalar>& estimate) {
    if (devices_.tap != nullptr) {
        devices_.tap->pose(estimate);
    }
    counters_.unsent_poses += devices_.link.send(estimate).ok() ? 0U : 1U;
}

template class MainLoop<double>;
template class MainLoop<float, tracking::ScaatTracker<float>, 1>;
template class MainLoop<float, tracking::PreviousTracker<float>, 1>;

}  // namespace tricoil::app
