#include "board/app/column_chain.hpp"

#include <utility>

#include "core/base/precision.hpp"

namespace tricoil::app {

/// Not inlined, so that its stack frame is free again when tick() needs one of the same size.
template <typename Scalar, typename SensorTracker>
[[gnu::noinline]] bool ColumnChain<Scalar, SensorTracker>::update(const SampleBlock& block, bool& after_gap,
                                                                  const Devices& devices, MainLoopCounters& counters) {
    auto columns = demodulator_.demodulate(block);
    if (!columns.ok()) {
        ++counters.refused_blocks;
        after_gap = true;
        return false;
    }
    return track(*columns, after_gap, devices, counters);
}

template <typename Scalar, typename SensorTracker>
bool ColumnChain<Scalar, SensorTracker>::track(signal::Columns<Scalar>& columns, bool& after_gap, const Devices& devices,
                                               MainLoopCounters& counters) {
    bool gave_pose = false;
    for (MeasuredColumn<Scalar>& column : columns) {
        column.flags.set_if(std::exchange(after_gap, false), ColumnFlag::after_gap);
        if (devices.tap != nullptr) {
            devices.tap->column(column);
        }
        if (const auto estimate = tracker_.update(column)) {
            send(*estimate, devices, counters);
            gave_pose = true;
        }
    }
    return gave_pose;
}

template <typename Scalar, typename SensorTracker>
void ColumnChain<Scalar, SensorTracker>::tick(std::uint8_t sensor, const Devices& devices, MainLoopCounters& counters) {
    const DeviceTime now = devices.clock.now();
    if (devices.tap != nullptr) {
        devices.tap->tick(sensor, now);
    }
    if (const auto estimate = tracker_.tick(now)) {
        send(*estimate, devices, counters);
    }
}

template <typename Scalar, typename SensorTracker>
Status ColumnChain<Scalar, SensorTracker>::set_hemisphere(std::uint8_t sensor, const Direction& towards, const Devices& devices) {
    if (devices.tap != nullptr) {
        devices.tap->hemisphere(sensor, towards);
    }
    return tracker_.set_hemisphere(towards);
}

template <typename Scalar, typename SensorTracker>
void ColumnChain<Scalar, SensorTracker>::send(const tracking::PoseEstimate<Scalar>& estimate, const Devices& devices,
                                              MainLoopCounters& counters) {
    if (devices.tap != nullptr) {
        devices.tap->pose(estimate);
    }
    counters.unsent_poses += devices.link.send(estimate).ok() ? 0U : 1U;
}

template class ColumnChain<float, tracking::ScaatTracker<float>>;
#if TRICOIL_SCALARS & 1  // float
template class ColumnChain<float, tracking::PreviousTracker<float>>;
#else
template class ColumnChain<double, tracking::AnyTracker>;
#endif

}  // namespace tricoil::app
