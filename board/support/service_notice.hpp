// Notifies systemd that a service is ready and alive (sd_notify protocol: datagram to NOTIFY_SOCKET).
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Does nothing without a service manager.
class ServiceNotice {
public:
    ServiceNotice();

    void ready() const { send("READY=1"); }
    /// Call it in the monitored loop. Sends at most twice per watchdog time of the service manager.
    void alive();

private:
    void send(std::string_view text) const;

    std::string address_;  // empty: no service manager
    drivers::FileDescriptor socket_;
    std::chrono::microseconds period_{0};  // between watchdog messages; 0: no watchdog
    std::chrono::steady_clock::time_point due_{};
};

/// True if standard output or standard error is the journal of systemd: JOURNAL_STREAM has its device and inode. A program may
/// inherit the variable without the journal.
bool writes_to_journal();

}  // namespace tricoil::host
