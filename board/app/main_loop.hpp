// The one main loop of every board: excite, sample, demodulate, track, send. It sees hardware only through hal references.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "board/app/column_chain.hpp"
#include "board/app/fixed_chain.hpp"

namespace tricoil::app {

/// Owns a chain per sensor, not the devices; memory for Sensors of them is part of the object. The coils are off before start(),
/// after any error and after destruction. Chain: from one sensor's blocks to its poses, ColumnChain or FixedChain.
template <typename Chain, int Sensors>
class BlockLoop {
public:
    using Params = typename Chain::Params;
    using Devices = typename Chain::Devices;

    BlockLoop(const Params& params, const Devices& devices);
    ~BlockLoop();
    BlockLoop(const BlockLoop&) = delete;
    BlockLoop& operator=(const BlockLoop&) = delete;

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

    /// Chain::set_hemisphere of a sensor that is there, between two blocks.
    Status set_hemisphere(std::size_t sensor, const typename Chain::Direction& towards);

    [[nodiscard]] const MainLoopCounters& counters() const { return counters_; }
    /// Of sensor 0 to sensors - 1.
    [[nodiscard]] auto& tracker(std::size_t sensor = 0) { return chains_[sensor]->tracker(); }

private:
    [[nodiscard]] Excitation next_state() const;
    void count_gap(std::uint32_t sequence);

    signal::AcquisitionPlan plan_;
    std::array<std::optional<Chain>, Sensors> chains_;  // the first sensor_count_ are there
    int sensor_count_;
    Devices devices_;
    SampleBlock block_;
    bool has_block_ = false;
    std::uint32_t expected_sequence_ = 0;
    int slot_ = 0;
    int blocks_of_slot_ = 0;   // polled since the last excitation
    int settling_blocks_ = 0;  // still to be dropped
    MainLoopCounters counters_;
};

template <typename Scalar, typename Tracker = tracking::AnyTracker<Scalar>, int Sensors = tracking::kMaxSensors>
using MainLoop = BlockLoop<ColumnChain<Scalar, Tracker>, Sensors>;
extern template class BlockLoop<ColumnChain<double, tracking::AnyTracker<double>>, tracking::kMaxSensors>;

/// The loops of boards with one sensor: with the filter, and with the previous-measurement technique.
using BoardLoop = MainLoop<float, tracking::ScaatTracker<float>, 1>;
using PreviousLoop = MainLoop<float, tracking::PreviousTracker<float>, 1>;
extern template class BlockLoop<ColumnChain<float, tracking::ScaatTracker<float>>, 1>;
extern template class BlockLoop<ColumnChain<float, tracking::PreviousTracker<float>>, 1>;

/// The loop of a board without a floating-point unit.
using FixedLoop = BlockLoop<FixedChain, 1>;
extern template class BlockLoop<FixedChain, 1>;

}  // namespace tricoil::app
