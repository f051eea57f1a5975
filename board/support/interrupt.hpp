// Signals as a flag that loops check, so that every run ends with a summary, complete files and coils off.
#pragma once

#include <array>
#include <csignal>

namespace tricoil::host {

/// While an object exists, SIGINT, SIGTERM, SIGHUP and SIGQUIT set a flag. A second signal ends the program at once. SIGHUP stays
/// ignored if it was ignored before (nohup).
class InterruptGuard {
public:
    InterruptGuard();
    ~InterruptGuard();
    InterruptGuard(const InterruptGuard&) = delete;
    InterruptGuard& operator=(const InterruptGuard&) = delete;

    [[nodiscard]] bool interrupted() const;

    /// Throws Interrupted if interrupted(). For work without a useful partial result.
    void check() const;

private:
    static constexpr std::array<int, 4> kSignals{SIGINT, SIGTERM, SIGHUP, SIGQUIT};
    std::array<struct sigaction, kSignals.size()> before_{};
};

}  // namespace tricoil::host
