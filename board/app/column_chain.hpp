// One sensor's samples to poses in floating point: demodulator, columns, tracker.
#pragma once

#include <cstdint>

#include "core/signal/demodulator.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/link.hpp"
#include "hal/tracker_tap.hpp"

namespace tricoil::app {

/// What a board puts behind the loop. All must outlive it.
template <typename Scalar>
struct Devices {
    hal::Clock& clock;
    hal::CoilDriver& coils;
    hal::CoilSampler& sampler;
    hal::Link<Scalar>& link;
    hal::TrackerTap<Scalar>* tap = nullptr;  // sees what the trackers are given and answer; none: nobody looks
};

template <typename Scalar>
struct MainLoopParams {
    signal::AcquisitionPlan plan;  // from plan_acquisition()
    signal::DemodulatorParams<Scalar> demodulator;
    tracking::TrackerParams<Scalar> tracker;  // must pass check()
    /// Of the coils that the columns are measured with; none: ideal triads.
    typename tracking::Tracker<Scalar>::Correction correction = std::nullopt;
    int sensors = 1;  // blocks that each excitation brings, one a sensor, in the order 0, 1, ...
};

struct MainLoopCounters {
    std::uint64_t blocks = 0;          // received
    std::uint64_t lost_blocks = 0;     // gaps in the sequence, and polls that timed out
    std::uint64_t refused_blocks = 0;  // that the demodulator refused, or of a sensor that is not there
    std::uint64_t unsent_poses = 0;    // that the link did not take
};

/// SensorTracker: AnyTracker, or, where memory is scarce, the tracker of one method.
template <typename Scalar, typename SensorTracker>
class ColumnChain {
public:
    using Params = MainLoopParams<Scalar>;
    using Devices = app::Devices<Scalar>;
    using Direction = Vec3<Scalar>;

    explicit ColumnChain(const Params& params)
        : demodulator_(params.plan, params.demodulator), tracker_(params.tracker, params.correction) {}

    /// Sends the block's poses; false if it gave none.
    bool update(const SampleBlock& block, const Devices& devices, MainLoopCounters& counters);

    /// Sends the pose that passing time gives.
    void tick(std::uint8_t sensor, const Devices& devices, MainLoopCounters& counters);

    Status set_hemisphere(std::uint8_t sensor, const Direction& towards, const Devices& devices);

    [[nodiscard]] SensorTracker& tracker() { return tracker_; }

private:
    void send(const tracking::PoseEstimate<Scalar>& estimate, const Devices& devices, MainLoopCounters& counters);

    signal::Demodulator<Scalar> demodulator_;
    SensorTracker tracker_;
};

}  // namespace tricoil::app
