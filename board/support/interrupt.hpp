// Ctrl-C, termination and hang-up as a flag that loops look at, so that every run ends in order: summary, whole files, coils off.
#pragma once

#include <array>
#include <csignal>

namespace tricoil::host {

/// While it lives, SIGINT, SIGTERM, SIGHUP and SIGQUIT set a flag instead of ending the program; a second one ends it at once.
/// SIGHUP stays ignored where it is (nohup).
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    [[nodiscard]] bool interrupted() const;

    /// For work whose half is worth nothing: throws Interrupted if interrupted().
    void check() const;

private:
    static constexpr std::array<int, 4> kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT};
    std::array<struct sigaction, kSignals.size()> before_{};
};

}  // namespace tricoil::host
