// The one main loop of every board: excite, sample, demodulate, track, send. It sees hardware only through hal references.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

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

/// Owns a demodulator and a tracker per sensor, not the devices; memory for Sensors of them is part of the object. The coils are
/// off before start(), after any error and after destruction. SensorTracker: AnyTracker, or, where memory is scarce, the tracker
/// of one method.
template <typename Scalar, typename SensorTracker = tracking::AnyTracker<Scalar>, int Sensors = tracking::kMaxSensors>
class MainLoop {
public:
    MainLoop(const MainLoopParams<Scalar>& params, Devices<Scalar> devices);
    ~MainLoop();
    MainLoop(const MainLoop&) = delete;
    MainLoop& operator=(const MainLoop&) = delete;

    /// Begins sampling. A sensor's first FDM block is dropped: it holds the switching-on, which TDM has a guard for in every
    /// slot. Errors: invalid_argument for a number of sensors outside 1 to Sensors, and those of CoilSampler::start.
    Status start();

    /// One block: acquire() then process(). Errors: those of acquire().
    Status step();

    /// Excites the next state, when the one before has brought a block for each sensor, and waits for a block. timed_out is
    /// survived (counted as lost); any other error has stopped the loop.
    Status acquire();

    /// Demodulates, tracks and sends the block that acquire() brought. A block that gives no pose is as good as none: the tracker
    /// is told the time.
    void process();

    /// Coils off, sampling ended; start() may follow.
    void stop();

    /// SensorTracker::set_hemisphere of a sensor that is there, between two blocks.
    Status set_hemisphere(std::size_t sensor, const Vec3<Scalar>& towards);

    [[nodiscard]] const MainLoopCounters& counters() const { return counters_; }
    /// Of sensor 0 to sensors - 1.
    [[nodiscard]] SensorTracker& tracker(std::size_t sensor = 0) { return sensors_[sensor]->tracker; }

private:
    struct Sensor {
        explicit Sensor(const MainLoopParams<Scalar>& params)
            : demodulator(params.plan, params.demodulator), tracker(params.tracker, params.correction) {}

        signal::Demodulator<Scalar> demodulator;
        SensorTracker tracker;
    };

    [[nodiscard]] Excitation next_state() const;
    void count_gap(std::uint32_t sequence);
    bool track(Sensor& sensor);
    void tick(std::size_t n);
    void send(const tracking::PoseEstimate<Scalar>& estimate);

    signal::AcquisitionPlan plan_;
    std::array<std::optional<Sensor>, Sensors> sensors_;  // the first sensor_count_ are there
    int sensor_count_;
    Devices<Scalar> devices_;
    SampleBlock block_;
    bool has_block_ = false;
    std::uint32_t expected_sequence_ = 0;
    int slot_ = 0;
    int blocks_of_slot_ = 0;   // polled since the last excitation
    int settling_blocks_ = 0;  // still to be dropped
    MainLoopCounters counters_;
};

extern template class MainLoop<double>;

/// The loops of boards with one sensor: with the filter, and with the previous-measurement technique.
using BoardLoop = MainLoop<float, tracking::ScaatTracker<float>, 1>;
using PreviousLoop = MainLoop<float, tracking::PreviousTracker<float>, 1>;
extern template class MainLoop<float, tracking::ScaatTracker<float>, 1>;
extern template class MainLoop<float, tracking::PreviousTracker<float>, 1>;

}  // namespace tricoil::app
