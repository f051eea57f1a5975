// The loop that drives a source: pause, pace, duration, health, interrupt.
#pragma once

#include <functional>

#include "board/stream/source.hpp"
#include "board/support/link_health.hpp"
#include "board/support/pacer.hpp"

namespace tricoil::host {

/// Functions may be empty.
struct LoopParams {
    bool realtime = false;  // at the pace of the source's clock, unless the source is live
    double duration_s = 0;  // of the source's clock; 0: to the end of the source
    HealthLimits health = {};
    std::function<void()> ready = {};                         // called once by run(), before the first step
    std::function<bool()> is_over = {};                       // called in each round: true ends the loop
    std::function<bool()> is_paused = {};                     // called in each round: true keeps the coils off
    std::function<bool()> must_wait = {};                     // called in each round: true while outputs cannot take more
    std::function<void(Source&)> each_step = {};              // called after each step
    std::function<void(HealthCounts&)> add_outputs = {};      // adds the queues of the outputs to the counts of the source
    std::function<void(const LinkHealth&)> each_health = {};  // called several times a second
};

class StreamLoop {
public:
    /// `source` must outlive this object.
    StreamLoop(Source& source, LoopParams params) : source_(source), params_(std::move(params)), monitor_(params_.health) {}

    /// Steps to the end of the source or its duration, to a signal (InterruptGuard), or until a function ends the loop. The coils
    /// are off afterwards. Throws what Source::advance() and the functions throw.
    void run();

    /// One step, or a part of a wait; it waits at most `patience`. Returns false at the end.
    bool step(Microseconds patience = Source::kLongestStep);

    [[nodiscard]] bool interrupted() const { return interrupted_; }
    [[nodiscard]] const LinkHealth& health() const { return monitor_.health(); }

private:
    void check_health();

    Source& source_;
    LoopParams params_;
    HealthMonitor monitor_;
    Pacer pacer_;
    bool interrupted_ = false;
};

/// Steps to the end of the source. each_step: called after each step. Throws Interrupted after a signal, because a part of the
/// result is of no use.
void run_to_end(Source& source, const std::function<void()>& each_step);

}  // namespace tricoil::host
