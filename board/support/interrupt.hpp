// Signals as a flag that loops check, so that every run ends with a summary, complete files and coils off.
#pragma once

#include <array>
#include <chrono>
#include <csignal>
#include <functional>

namespace tricoil::host {

/// For programs that handle signals themselves: while an object exists, InterruptGuards of this thread install no handlers. They
/// ask `is_interrupted` instead, at most every 20 ms.
class BorrowedInterrupt {
public:
    explicit BorrowedInterrupt(std::function<bool()> is_interrupted);
    ~BorrowedInterrupt();
    BorrowedInterrupt(const BorrowedInterrupt&) = delete;
    BorrowedInterrupt& operator=(const BorrowedInterrupt&) = delete;

    [[nodiscard]] bool interrupted();

private:
    static constexpr std::chrono::milliseconds kInterval{20};

    std::function<bool()> is_interrupted_;
    BorrowedInterrupt* outer_;
    std::chrono::steady_clock::time_point asked_{};
    bool interrupted_ = false;
};

/// While an object exists, SIGINT, SIGTERM, SIGHUP and SIGQUIT set a flag. The same signal again ends the program at once. SIGHUP
/// stays ignored if it was ignored before (nohup). A guard within another one sees what that one has seen.
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
    BorrowedInterrupt* borrowed_;  // null: own handlers
};

}  // namespace tricoil::host
