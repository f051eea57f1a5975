#include "sim/virtual_board/machine/nvic.hpp"

#include <algorithm>

#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr int kNoPriority = 256;  // lower than every priority
// Offsets from 0xE000E100.
constexpr std::uint32_t kSetEnable = 0x000;
constexpr std::uint32_t kClearEnable = 0x080;
constexpr std::uint32_t kSetPending = 0x100;
constexpr std::uint32_t kClearPending = 0x180;
constexpr std::uint32_t kActive = 0x200;
constexpr std::uint32_t kPriority = 0x300;
constexpr std::uint32_t kWords = (kInterrupts + 31) / 32;

bool in(std::uint32_t offset, std::uint32_t first) { return offset >= first && offset < first + 4 * kWords; }

}  // namespace

void Nvic::set_level(InterruptLine line, bool high) {
    State& s = state(kFirstInterrupt + line.number);
    const std::uint32_t before = s.levels;
    const std::uint32_t mine = 1U << line.source;
    s.levels = high ? before | mine : before & ~mine;
    if (before == 0 && s.levels != 0) {
        pend(kFirstInterrupt + line.number);
    }
}

void Nvic::pend(int exception) {
    State& s = state(exception);
    if (!s.pending) {
        s.pending = true;
        s.since = events_.now();
        ++pending_count_;
        changed();
    }
}

void Nvic::unpend(int exception) {
    State& s = state(exception);
    pending_count_ -= s.pending ? 1 : 0;
    s.pending = false;
    changed();
}

int Nvic::group_priority(int exception) const {
    if (exception < 4) {
        return exception - 4;  // reset -3, NMI -2, HardFault -1: above all other exceptions
    }
    return state(exception).priority & ~((2U << group_) - 1U) & 0xFFU;
}

/// The most urgent pending and enabled exception if it is more urgent than the running one; otherwise 0.
int Nvic::most_urgent() const {
    if (urgent_ != kUnknown) {
        return urgent_;
    }
    int running = kNoPriority;
    int best = 0;
    for (int e = kNmi; e < kExceptions; ++e) {
        const State& s = state(e);
        const bool higher = best == 0 || group_priority(e) < group_priority(best) ||
                            (group_priority(e) == group_priority(best) && e >= 4 && s.priority < state(best).priority);
        if (s.pending && (e < kFirstInterrupt || s.enabled) && higher) {
            best = e;
        }
        running = s.active ? std::min(running, group_priority(e)) : running;
    }
    urgent_ = best != 0 && group_priority(best) < running ? best : 0;
    return urgent_;
}

int Nvic::to_take(const Masks& masks) const {
    const int best = pending_count_ > 0 ? most_urgent() : 0;
    if (best == 0) {
        return 0;
    }
    int limit = kNoPriority;
    if (masks.basepri != 0) {
        limit = static_cast<int>(masks.basepri & ~((2U << group_) - 1U) & 0xFFU);
    }
    limit = masks.primask ? std::min(limit, 0) : limit;
    limit = masks.faultmask ? std::min(limit, -1) : limit;
    return group_priority(best) < limit ? best : 0;
}

bool Nvic::wakes(Masks masks) const {
    masks.primask = false;
    return to_take(masks) != 0;
}

void Nvic::enter(int exception) {
    unpend(exception);
    State& s = state(exception);
    s.active = true;
    ++active_count_;
    changed();
    Latency& latency = latencies_[static_cast<std::size_t>(exception)];
    latency.worst = std::max(latency.worst, events_.now() - s.since);
    ++latency.entries;
}

void Nvic::leave(int exception) {
    State& s = state(exception);
    fail_if(!s.active, "return from an exception that is not active");
    s.active = false;
    --active_count_;
    changed();
    if (s.levels != 0) {
        pend(exception);
    }
}

int Nvic::first_pending() const {
    for (int e = kNmi; e < kExceptions; ++e) {
        if (state(e).pending && (e < kFirstInterrupt || state(e).enabled)) {
            return e;
        }
    }
    return 0;
}

template <typename Act>
void Nvic::for_bits(std::uint32_t word, std::uint32_t value, Act act) {
    for (std::uint32_t bit = 0; bit < 32; ++bit) {
        const int interrupt = static_cast<int>(32 * word + bit);
        if ((value >> bit & 1U) != 0 && interrupt < kInterrupts) {
            act(kFirstInterrupt + interrupt);
        }
    }
}

std::uint32_t Nvic::read(std::uint32_t offset) {
    const std::uint32_t word = (offset & 0x7FU) / 4;
    std::uint32_t value = 0;
    const auto collect = [&](auto is_set) {
        for_bits(word, ~0U, [&](int e) { value |= is_set(state(e)) ? 1U << (e - kFirstInterrupt) % 32 : 0U; });
        return value;
    };
    if (in(offset, kSetEnable) || in(offset, kClearEnable)) {
        return collect([](const State& s) { return s.enabled; });
    }
    if (in(offset, kSetPending) || in(offset, kClearPending)) {
        return collect([](const State& s) { return s.pending; });
    }
    if (in(offset, kActive)) {
        return collect([](const State& s) { return s.active; });
    }
    if (offset >= kPriority && offset < kPriority + kInterrupts) {
        for (unsigned byte = 0; byte < 4 && offset - kPriority + byte < kInterrupts; ++byte) {
            value |= static_cast<std::uint32_t>(priority(kFirstInterrupt + static_cast<int>(offset - kPriority + byte)))
                     << 8U * byte;
        }
        return value;
    }
    throw RunFailure("no such register");
}

void Nvic::write(std::uint32_t offset, std::uint32_t value) {
    const std::uint32_t word = (offset & 0x7FU) / 4;
    if (const bool enables = in(offset, kSetEnable); enables || in(offset, kClearEnable)) {
        changed();
        for_bits(word, value, [&](int e) { state(e).enabled = enables; });
    } else if (in(offset, kSetPending)) {
        for_bits(word, value, [this](int e) { pend(e); });
    } else if (in(offset, kClearPending)) {
        for_bits(word, value, [this](int e) {
            unpend(e);
            if (state(e).levels != 0 && !state(e).active) {
                pend(e);  // the interrupt output of the peripheral is still high
            }
        });
    } else if (offset >= kPriority && offset < kPriority + kInterrupts) {
        write_narrow(offset, value, 4);
    } else {
        throw RunFailure("no such register");
    }
}

void Nvic::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    for (unsigned byte = 0; byte < bytes; ++byte) {
        const std::uint32_t at = offset + byte - kPriority;
        fail_if(offset < kPriority || at >= kInterrupts, "no such register");
        set_priority(kFirstInterrupt + static_cast<int>(at), static_cast<std::uint8_t>(value >> 8U * byte));
    }
}

void Nvic::reset() {
    for (State& s : states_) {
        s = State{};
    }
    group_ = 0;
    pending_count_ = 0;
    active_count_ = 0;
    changed();
}

}  // namespace tricoil::virtual_board
