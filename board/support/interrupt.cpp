#include "board/support/interrupt.hpp"

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

// Received signal; 0: none. Static, because a signal handler can access only static storage.
volatile std::sig_atomic_t interrupt_seen = 0;

void on_signal(int signal) { interrupt_seen = signal; }

}  // namespace

InterruptGuard::InterruptGuard() {
    interrupt_seen = 0;
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
    for (std::size_t n = 0; n < kSignals.size(); ++n) {
        ::sigaction(kSignals[n], nullptr, &before_[n]);
        const bool stays_ignored = kSignals[n] == SIGHUP && before_[n].sa_handler == SIG_IGN;
        if (!stays_ignored) {
            ::sigaction(kSignals[n], &action, nullptr);
        }
    }
}

InterruptGuard::~InterruptGuard() {
    for (std::size_t n = 0; n < kSignals.size(); ++n) {
        ::sigaction(kSignals[n], &before_[n], nullptr);
    }
}

bool InterruptGuard::interrupted() const { return interrupt_seen != 0; }

void InterruptGuard::check() const {
    if (interrupted()) {
        throw Interrupted(interrupt_seen);
    }
}

}  // namespace tricoil::host
