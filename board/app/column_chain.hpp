// Processing of one sensor in floating point: samples, columns, poses.
#pragma once

#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/signal/demodulator.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "core/tracking/tracker_tap.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/link.hpp"

namespace tricoil::app {

/// Hardware interfaces of the loop. All must outlive it.
template <typename Scalar>
struct Devices {
    hal::Clock& clock;
    hal::CoilDriver& coils;
    hal::CoilSampler& sampler;
    hal::Link<Scalar>& link;
    tracking::TrackerTap<Scalar>* tap = nullptr;  // observes inputs and outputs of the trackers; may be null
};

template <typename Scalar>
struct MainLoopParams {
    signal::AcquisitionPlan plan;  // from plan_acquisition()
    signal::DemodulatorParams<Scalar> demodulator;
    tracking::TrackerParams<Scalar> tracker;  // must pass check()
    /// Correction of the measured columns; none: ideal triads.
    typename tracking::Tracker<Scalar>::Correction correction = std::nullopt;
    /// Calibration of real coils, instead of `correction`, for trackers that support them; null: none. Read at construction.
    const calibration::Calibration<Scalar>* coils = nullptr;
    int sensors = 1;  // each excitation brings one block per sensor, in the order 0, 1, ...
};

struct MainLoopCounters {
    std::uint64_t blocks = 0;          // received
    std::uint64_t lost_blocks = 0;     // gaps in the sequence, and polls that timed out
    std::uint64_t refused_blocks = 0;  // refused by the demodulator, or with an unknown sensor index
    std::uint64_t unsent_poses = 0;    // refused by the link
};

/// SensorTracker: AnyTracker, or the tracker of one method to save memory.
template <typename Scalar, typename SensorTracker>
class ColumnChain {
public:
    using Params = MainLoopParams<Scalar>;
    using Devices = app::Devices<Scalar>;
    using Direction = Vec3<Scalar>;

    explicit ColumnChain(const Params& params) : demodulator_(params.plan, params.demodulator), tracker_(make_tracker(params)) {}

    /// Sends the poses of the block; false if it gave none. after_gap: blocks of the sensor were lost or refused since its last
    /// one. It is set if this block is refused, cleared otherwise.
    bool update(const SampleBlock& block, bool& after_gap, const Devices& devices, MainLoopCounters& counters);
    /// The same for the columns of a block.
    bool track(signal::Columns<Scalar>& columns, bool& after_gap, const Devices& devices, MainLoopCounters& counters);

    /// Calls the tracker's tick() and sends its pose, if any.
    void tick(std::uint8_t sensor, const Devices& devices, MainLoopCounters& counters);

    Status set_hemisphere(std::uint8_t sensor, const Direction& towards, const Devices& devices);

    [[nodiscard]] SensorTracker& tracker() { return tracker_; }

private:
    static SensorTracker make_tracker(const Params& params) {
        if constexpr (std::is_same_v<SensorTracker, tracking::AnyTracker>) {
            if (params.coils != nullptr) {
                return SensorTracker(params.tracker, std::optional(*params.coils));
            }
        }
        return SensorTracker(params.tracker, params.correction);
    }
    void send(const tracking::PoseEstimate<Scalar>& estimate, const Devices& devices, MainLoopCounters& counters);

    signal::Demodulator<Scalar> demodulator_;
    SensorTracker tracker_;
};

}  // namespace tricoil::app
