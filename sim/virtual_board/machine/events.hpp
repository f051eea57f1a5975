// Timed events of the board's hardware outside the processor.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "sim/virtual_board/machine/time.hpp"

namespace tricoil::virtual_board {

class Event;

/// Present time and pending events. Events of the same time run in the order of their construction.
class Events {
public:
    [[nodiscard]] Ticks now() const { return now_; }
    [[nodiscard]] Ticks next() const { return next_; }

    /// Called by the processor to advance time; runs all events that are due by `time`.
    void advance(Ticks time);
    /// Advances time without running events; they run at the next advance().
    void pass(Ticks time) { now_ += time; }

private:
    friend class Event;
    void look_for_next();

    Ticks now_ = 0;
    Ticks next_ = kNever;
    std::vector<Event*> events_;
};

/// One event, pending at most once. Lives as long as its Events.
class Event {
public:
    Event(Events& events, std::function<void()> act) : events_(events), act_(std::move(act)) { events.events_.push_back(this); }
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;

    void at(Ticks time) {
        when_ = time;
        events_.look_for_next();
    }
    void in(Ticks delay) { at(events_.now() + delay); }
    void cancel() { at(kNever); }
    [[nodiscard]] bool is_due() const { return when_ != kNever; }
    [[nodiscard]] Ticks when() const { return when_; }

private:
    friend class Events;
    Events& events_;
    std::function<void()> act_;
    Ticks when_ = kNever;
};

inline void Events::look_for_next() {
    next_ = kNever;
    for (const Event* event : events_) {
        next_ = event->when_ < next_ ? event->when_ : next_;
    }
}

inline void Events::advance(Ticks time) {
    while (next_ <= time) {
        for (Event* event : events_) {
            if (event->when_ == next_) {
                now_ = next_;
                event->when_ = kNever;
                look_for_next();
                event->act_();
                break;
            }
        }
    }
    now_ = time;
}

}  // namespace tricoil::virtual_board
