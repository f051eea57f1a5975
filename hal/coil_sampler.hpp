// The sensor coils' converters.
#pragma once

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::hal {

/// Samples three sensor coils and the reference current simultaneously, block by block.
class CoilSampler {
public:
    CoilSampler() = default;
    CoilSampler(const CoilSampler&) = delete;
    CoilSampler& operator=(const CoilSampler&) = delete;
    virtual ~CoilSampler() = default;

    /// Begins sampling blocks as planned. Thread context.
    /// ok; invalid_argument: a rate or length that this converter does not have; device_lost.
    Status start(const signal::AcquisitionPlan& plan) { return do_start(plan); }

    /// The next block, oldest first; its samples stay valid until the next poll() or start(). Waits at most about two blocks.
    /// Thread context. ok; timed_out: no block came, sampling goes on; end_of_stream: a finite source is exhausted; not_ready:
    /// the power stages have switched off by themselves, over-current; device_lost. A gap in SampleBlock::sequence tells of lost
    /// blocks.
    Status poll(SampleBlock& block) { return do_poll(block); }

    /// Ends sampling; start() may follow. Cannot fail.
    void stop() { do_stop(); }

private:
    virtual Status do_start(const signal::AcquisitionPlan& plan) = 0;
    virtual Status do_poll(SampleBlock& block) = 0;
    virtual void do_stop() = 0;
};

}  // namespace tricoil::hal
