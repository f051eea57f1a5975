// The thread that serves clients: woken by them, and by new poses.
#pragma once

#include <memory>
#include <thread>
#include <vector>

#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/service.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Owns the hub, for the tracker to tap into, and the services.
class Server {
public:
    Server();
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    [[nodiscard]] PoseHub& hub() { return hub_; }

    /// Before start().
    void add(std::unique_ptr<Service> service) { services_.push_back(std::move(service)); }
    void start();
    /// Ends the thread; the services, and with them their clients' lines, live on until destruction.
    void stop();

private:
    void run();
    void wake();

    drivers::FileDescriptor bell_;  // an eventfd
    PoseHub hub_;
    std::vector<std::unique_ptr<Service>> services_;
    std::thread thread_;
};

}  // namespace tricoil::host
