// Thread that serves clients. Client input and new poses wake it.
#pragma once

#include <memory>
#include <thread>
#include <vector>

#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Owns the services, the hub, which is a tap of the tracker, and the button of the stylus.
class Server {
public:
    Server();
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    [[nodiscard]] PoseHub& hub() { return hub_; }
    [[nodiscard]] StylusButton& button() { return button_; }

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
    StylusButton button_;
    std::vector<std::unique_ptr<Service>> services_;
    std::thread thread_;
};

}  // namespace tricoil::host
