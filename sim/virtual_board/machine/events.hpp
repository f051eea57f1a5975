// Timed events of the board's hardware outside the processor.
#pragma once

#include <algorithm>
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

    /// Stop mode: the pending events of the chip's stopped clocks wait until thaw().
    void freeze();
    void thaw();
    /// A reset in Stop mode: the waiting events are gone.
    void forget_frozen() {
        frozen_.clear();
        is_frozen_ = false;
    }
    [[nodiscard]] bool is_frozen() const { return is_frozen_; }

private:
    friend class Event;
    void add(Event& event);
    void drop(Event& event);
    void update_next();

    Ticks now_ = 0;
    Ticks next_ = kNever;
    unsigned constructed_ = 0;
    std::vector<Event*> pending_;
    std::vector<std::pair<Event*, Ticks>> frozen_;  // remaining time
    bool is_frozen_ = false;
};

/// One event, pending at most once. Lives as long as its Events.
class Event {
public:
    /// Clock that drives an event: one that stops in Stop mode, or one that always runs (low-speed oscillators, other boards).
    enum class Clock : bool { stops, always };

    Event(Events& events, std::function<void()> act, Clock clock = Clock::stops)
        : events_(events), act_(std::move(act)), number_(events.constructed_++), clock_(clock) {}
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;

    void at(Ticks time);
    void in(Ticks delay) { at(events_.now() + delay); }
    void cancel();
    [[nodiscard]] bool is_due() const { return when_ != kNever; }
    [[nodiscard]] Ticks when() const { return when_; }

private:
    friend class Events;
    [[nodiscard]] bool before(const Event& other) const {
        return when_ != other.when_ ? when_ < other.when_ : number_ < other.number_;
    }

    Events& events_;
    std::function<void()> act_;
    Ticks when_ = kNever;
    unsigned number_;
    Clock clock_;
};

inline void Event::at(Ticks time) {
    const bool was_due = is_due();
    when_ = time;
    if (was_due) {
        events_.update_next();
    } else {
        events_.add(*this);
    }
}

inline void Event::cancel() {
    if (is_due()) {
        when_ = kNever;
        events_.drop(*this);
    }
}

inline void Events::add(Event& event) {
    pending_.push_back(&event);
    next_ = std::min(next_, event.when_);
}

inline void Events::drop(Event& event) {
    std::erase(pending_, &event);
    update_next();
}

inline void Events::update_next() {
    next_ = kNever;
    for (const Event* event : pending_) {
        next_ = std::min(next_, event->when_);
    }
}

inline void Events::advance(Ticks time) {
    while (next_ <= time) {
        Event* first = pending_.front();
        for (Event* event : pending_) {
            first = event->before(*first) ? event : first;
        }
        now_ = next_;
        first->cancel();
        first->act_();
    }
    now_ = time;
}

inline void Events::freeze() {
    is_frozen_ = true;
    const auto waiting = pending_;
    for (Event* event : waiting) {
        if (event->clock_ == Event::Clock::stops) {
            frozen_.emplace_back(event, event->when_ - now_);
            event->cancel();
        }
    }
}

inline void Events::thaw() {
    is_frozen_ = false;
    for (const auto& [event, left] : std::exchange(frozen_, {})) {
        event->in(left);
    }
}

}  // namespace tricoil::virtual_board
