// Main loop of every board: excite, sample, demodulate, track, send. It uses hardware only through hal references.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "board/app/column_chain.hpp"
#include "board/app/fixed_chain.hpp"

namespace tricoil::app {

/// Owns a chain per sensor (memory for `Sensors` chains is part of the object), but not the devices. The coils are off before
/// start(), after any error and after destruction. Chain: ColumnChain or FixedChain.
template <typename Chain, int Sensors>
class BlockLoop {
public:
    using Params = typename Chain::Params;
    using Devices = typename Chain::Devices;

    BlockLoop(const Params& params, const Devices& devices);
    ~BlockLoop();

    /// Starts sampling; after stop() the next columns get the flag `after_gap`. The first FDM block of each sensor is dropped,
    /// because it contains the switching transient; TDM has a guard in every slot. Errors: invalid_argument for a number of
    /// sensors outside 1 to Sensors, and those of CoilSampler::start.
    Status start();

    /// Processes one block: acquire() then process(). Errors: those of acquire().
    Status step();

    /// Excites the next state after one poll per sensor in the present state, then waits for a block. After timed_out the loop
    /// continues (the block is counted as lost). After any other error it has stopped.
    Status acquire();

    /// Demodulates, tracks and sends the block from acquire(). If the block gives no pose, tick() is called instead.
    void process();

    /// Switches the coils off and stops sampling. start() may follow.
    void stop();

    /// Calls Chain::set_hemisphere of a sensor. Only between two blocks.
    Status set_hemisphere(std::size_t sensor, const typename Chain::Direction& towards);

    [[nodiscard]] const MainLoopCounters& counters() const { return counters_; }
    /// Tracker of sensor 0 to sensors - 1.
    [[nodiscard]] auto& tracker(std::size_t sensor = 0) { return chains_[sensor]->tracker(); }

private:
    [[nodiscard]] Excitation next_state() const;
    void count_gap(std::uint32_t sequence);

    signal::AcquisitionPlan plan_;
    std::array<std::optional<Chain>, Sensors> chains_;  // the first sensor_count_ are used
    int sensor_count_;
    Devices devices_;
    SampleBlock block_;
    bool has_block_ = false;
    std::uint32_t expected_sequence_ = 0;
    std::array<bool, Sensors> after_gap_{};  // by sensor: blocks were lost or refused since its last one
    int slot_ = 0;
    int blocks_of_slot_ = 0;   // polled since the last excitation
    int settling_blocks_ = 0;  // still to be dropped
    MainLoopCounters counters_;
};

template <typename Scalar, typename Tracker = tracking::AnyTracker, int Sensors = tracking::kMaxSensors>
using MainLoop = BlockLoop<ColumnChain<Scalar, Tracker>, Sensors>;
extern template class BlockLoop<ColumnChain<double, tracking::AnyTracker>, tracking::kMaxSensors>;

/// Loops of boards with one sensor: with the filter, and with the previous-measurement technique.
using BoardLoop = MainLoop<float, tracking::ScaatTracker<float>, 1>;
using PreviousLoop = MainLoop<float, tracking::PreviousTracker<float>, 1>;
extern template class BlockLoop<ColumnChain<float, tracking::ScaatTracker<float>>, 1>;
extern template class BlockLoop<ColumnChain<float, tracking::PreviousTracker<float>>, 1>;

/// Loop of boards without a floating-point unit.
using FixedLoop = BlockLoop<FixedChain, 1>;
extern template class BlockLoop<FixedChain, 1>;

}  // namespace tricoil::app
