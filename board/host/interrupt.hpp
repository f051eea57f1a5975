// Ctrl-C and termination as a flag that loops look at, so that every run ends in order: summary, whole files, coils off.
#pragma once

namespace tricoil::host {

/// While it lives, SIGINT and SIGTERM set a flag instead of ending the program; a second one ends it at once.
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;
    [[nodiscard]] bool interrupted() const;
};

}  // namespace tricoil::host
