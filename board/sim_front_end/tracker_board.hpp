// Simulated tracker board: the firmware application of board/app with a simulated world.
#pragma once

#include <optional>
#include <vector>

#include "board/app/tracker_device.hpp"
#include "board/sim_front_end/acknowledgement_monitor.hpp"
#include "sim/front_end/front_end.hpp"
#include "sim/hal/simulated_processor.hpp"
#include "sim/hal/simulated_storage.hpp"

namespace tricoil::sim_front_end {

/// Sampling advances the device time; a step without a measurement advances it by one millisecond. In lockstep the board waits
/// for the host; with real pace a block lasts as long as its samples.
class TrackerBoard {
public:
    /// `port` must be open. Throws InputError for an impossible frame rate or an invalid calibration.
    TrackerBoard(hal::MessagePort& port, const sim::FrontEndParams& params);

    /// Serves the link, and measures a block if one is due. `now`: the host's monotonic clock. Waits at most one millisecond.
    void step(HostTime now);

    /// True if the requested duration is over, or the board is in its loader.
    [[nodiscard]] bool finished() const { return finished_; }
    [[nodiscard]] sim::FrontEndCounters counters() const;
    [[nodiscard]] bool coils_on() const { return coils_.state() != Excitation::off; }
    /// Content of the flash; empty: no calibration.
    [[nodiscard]] std::vector<std::uint8_t> calibration();

private:
    [[nodiscard]] app::DeviceHardware hardware();
    [[nodiscard]] app::DeviceParams device_params();
    void store_calibration();
    [[nodiscard]] bool is_running() const { return device_->state() == protocol::DeviceState::running; }
    [[nodiscard]] bool block_is_due(HostTime now) const;
    void measure(HostTime now);
    void idle();

    sim::FrontEndParams params_;
    sim::CoilWorld world_;
    std::vector<app::MeasuringMode> modes_;
    AcknowledgementMonitor port_;
    std::array<hal::MessagePort*, 1> ports_{&port_};
    sim::SimulatedClock clock_;
    sim::SimulatedCoilDriver coils_;
    sim::SimulatedGain gain_{{}, 1};
    sim::SimulatedCoilSampler sampler_;
    sim::SimulatedStorage storage_{2, 2048};
    sim::SimulatedWatchdog watchdog_{clock_};
    sim::SimulatedSystem system_{clock_};
    sim::SimulatedIndicator indicator_;
    sim::SimulatedButton button_;
    sim::SimulatedMonitor monitor_;
    sim::SimulatedHeartbeat heartbeat_;
    std::optional<app::TrackerDevice> device_;

    bool was_running_ = false;
    bool finished_ = false;
    double measured_s_ = 0;    // since the newest start
    double heard_s_ = 0;       // device time of the host's last message
    double pace_begin_s_ = 0;  // device time at the start; pace_begin_: the host's time
    HostTime pace_begin_;
    HostTime block_begin_;  // when the newest block was measured
    sim::FrontEndCounters counters_;
};

}  // namespace tricoil::sim_front_end
