// Tells systemd that a service is ready and still at work (sd_notify's protocol: a datagram to NOTIFY_SOCKET).
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Does nothing where no service manager asks for it.
class ServiceNotice {
public:
    ServiceNotice();

    void ready() const { send("READY=1"); }
    /// To be called by the loop that must not hang; sends at most twice within the manager's watchdog time.
    void alive();

private:
    void send(std::string_view text) const;

    std::string address_;  // empty: nobody asks
    drivers::FileDescriptor socket_;
    std::chrono::microseconds period_{0};  // between signs of life; 0: none wanted
    std::chrono::steady_clock::time_point due_{};
};

}  // namespace tricoil::host
