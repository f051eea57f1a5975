#include "board/support/interrupt.hpp"

#include <atomic>
#include <mutex>
#include <utility>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

// Received signal; 0: none. Static, because a signal handler can access only static storage; atomic, because it may run in any
// thread.
std::atomic<int> interrupt_seen = 0;
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler must not wait");

thread_local BorrowedInterrupt* borrowed = nullptr;  // innermost of this thread
// Guards with handlers, or within one that has them; those of several threads may end in any order.
std::mutex guards_mutex;
int guards = 0;
std::array<struct sigaction, 4> handlers_before{};

void on_signal(int signal) { interrupt_seen = signal; }

}  // namespace

BorrowedInterrupt::BorrowedInterrupt(std::function<bool()> is_interrupted)
    : is_interrupted_(std::move(is_interrupted)), outer_(std::exchange(borrowed, this)) {}

BorrowedInterrupt::~BorrowedInterrupt() { borrowed = outer_; }

bool BorrowedInterrupt::interrupted() {
    const auto now = std::chrono::steady_clock::now();
    if (!interrupted_ && now - asked_ >= kInterval) {
        asked_ = now;
        interrupted_ = is_interrupted_();
    }
    return interrupted_;
}

InterruptGuard::InterruptGuard() : borrowed_(borrowed) {
    if (borrowed_ != nullptr) {
        return;
    }
    const std::lock_guard lock(guards_mutex);
    if (guards++ > 0) {
        return;
    }
    interrupt_seen = 0;
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
    for (std::size_t n = 0; n < kSignals.size(); ++n) {
        ::sigaction(kSignals[n], nullptr, &handlers_before[n]);
        const bool stays_ignored = kSignals[n] == SIGHUP && handlers_before[n].sa_handler == SIG_IGN;
        if (!stays_ignored) {
            ::sigaction(kSignals[n], &action, nullptr);
        }
    }
}

InterruptGuard::~InterruptGuard() {
    if (borrowed_ != nullptr) {
        return;
    }
    const std::lock_guard lock(guards_mutex);
    if (--guards > 0) {
        return;
    }
    for (std::size_t n = 0; n < kSignals.size(); ++n) {
        ::sigaction(kSignals[n], &handlers_before[n], nullptr);
    }
}

bool InterruptGuard::interrupted() const { return borrowed_ != nullptr ? borrowed_->interrupted() : interrupt_seen != 0; }

void InterruptGuard::check() const {
    if (interrupted()) {
        throw Interrupted(borrowed_ != nullptr ? SIGINT : interrupt_seen.load());
    }
}

}  // namespace tricoil::host
