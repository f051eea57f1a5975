// Thread that serves clients. Client input and new poses wake it.
#pragma once

#include <memory>
#include <thread>
#include <vector>

#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/service.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Owns the services and the hub, which is a tap of the tracker.
class Server {
public:
    Server();
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    [[nodiscard]] PoseHub& hub() { return hub_; }

    /// Call it before start().
    void add(std::unique_ptr<Service> service) { services_.push_back(std::move(service)); }
    void start();
    /// Ends the thread. Services and client connections stay until destruction.
    void stop();

private:
    void run();
    void wake();

    drivers::FileDescriptor bell_;  // eventfd that wakes the thread
    PoseHub hub_;
    std::vector<std::unique_ptr<Service>> services_;
    std::thread thread_;
};

}  // namespace tricoil::host
