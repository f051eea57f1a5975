// The one main loop of every board: excite, sample, demodulate, track, send. It sees hardware only through hal references.
#pragma once

#include <array>
#include <cstdint>

#include "core/signal/demodulator.hpp"
#include "core/tracking/tracker.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/link.hpp"

namespace tricoil::app {

/// What a board puts behind the loop. All must outlive it.
template <typename Scalar>
struct Devices {
    hal::Clock& clock;
    hal::CoilDriver& coils;
    hal::CoilSampler& sampler;
    hal::Link<Scalar>& link;
};

template <typename Scalar>
struct MainLoopParams {
    signal::AcquisitionPlan plan;  // from plan_acquisition()
    signal::DemodulatorParams<Scalar> demodulator;
    tracking::TrackerParams<Scalar> tracker;  // must pass check()
};

struct MainLoopCounters {
    std::uint64_t blocks = 0;          // received
    std::uint64_t lost_blocks = 0;     // gaps in the sequence, and polls that timed out
    std::uint64_t refused_blocks = 0;  // that the demodulator refused
    std::uint64_t unsent_poses = 0;    // that the link did not take
};

/// Owns the demodulator and the tracker, not the devices. The coils are off before start(), after any error and after
/// destruction.
template <typename Scalar>
class MainLoop {
public:
    MainLoop(const MainLoopParams<Scalar>& params, Devices<Scalar> devices);
    ~MainLoop();
    MainLoop(const MainLoop&) = delete;
    MainLoop& operator=(const MainLoop&) = delete;

    /// Begins sampling. The first FDM block is dropped: it holds the switching-on, which TDM has a guard for in every slot.
    /// Errors: those of CoilSampler::start.
    Status start();

    /// One block: acquire() then process(). Errors: those of acquire().
    Status step();

    /// Excites the next state and waits for its block. timed_out is survived (counted as lost); any other error has stopped the
    /// loop.
    Status acquire();

    /// Demodulates, tracks and sends the block that acquire() brought.
    void process();

    /// Coils off, sampling ended; start() may follow.
    void stop();

    [[nodiscard]] const MainLoopCounters& counters() const { return counters_; }
    [[nodiscard]] tracking::Tracker<Scalar>& tracker() { return tracker_; }

private:
    [[nodiscard]] Excitation next_state() const;
    void count_gap(std::uint32_t sequence);
    void send(const tracking::PoseEstimate<Scalar>& estimate);

    signal::AcquisitionPlan plan_;
    signal::Demodulator<Scalar> demodulator_;
    tracking::Tracker<Scalar> tracker_;
    Devices<Scalar> devices_;
    SampleBlock block_;
    bool has_block_ = false;
    std::uint32_t expected_sequence_ = 0;
    int slot_ = 0;
    int settling_blocks_ = 0;  // still to be dropped
    MainLoopCounters counters_;
};

extern template class MainLoop<float>;
extern template class MainLoop<double>;

}  // namespace tricoil::app
