#include "board/host/interrupt.hpp"

#include <csignal>

namespace tricoil::host {
namespace {

// A signal handler can reach nothing but static storage.
volatile std::sig_atomic_t interrupt_seen = 0;

void on_signal(int signal) {
    interrupt_seen = 1;
    std::signal(signal, SIG_DFL);
}

}  // namespace

InterruptGuard::InterruptGuard() {
    interrupt_seen = 0;
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
}

InterruptGuard::~InterruptGuard() {
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
}

bool InterruptGuard::interrupted() const { return interrupt_seen != 0; }

}  // namespace tricoil::host
