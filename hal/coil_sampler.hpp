// Converters of the sensor coils.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::hal {

/// Samples three sensor coils and the reference current simultaneously, block by block.
class CoilSampler : public Interface {
public:
    /// Starts sampling blocks according to the plan. Thread context. ok; invalid_argument: the converter does not support the
    /// rate or the block length; device_lost.
    Status start(const signal::AcquisitionPlan& plan) { return do_start(plan); }

    /// Returns the next block, oldest first; its samples stay valid until the next poll() or start(). Waits at most about two
    /// blocks. Thread context. ok; timed_out: no block arrived, sampling continues; end_of_stream: a finite source is exhausted;
    /// over_current: the power stages have shut down because of over-current; device_lost. A gap in SampleBlock::sequence means
    /// lost blocks.
    Status poll(SampleBlock& block) { return do_poll(block); }

    /// Stops sampling; start() may follow. Cannot fail.
    void stop() { do_stop(); }

private:
    virtual Status do_start(const signal::AcquisitionPlan& plan) = 0;
    virtual Status do_poll(SampleBlock& block) = 0;
    virtual void do_stop() = 0;
};

}  // namespace tricoil::hal
