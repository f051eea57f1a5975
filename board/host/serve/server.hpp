// Threads that serve clients. Client input and new poses wake them.
#pragma once

#include <atomic>
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

    [[nodiscard]] PoseHub& hub() { return hub_; }
    [[nodiscard]] StylusButton& button() { return button_; }

    /// Call it before start().
    void add(std::unique_ptr<Service> service) { main_.services.push_back(std::move(service)); }
    /// For a service that reads files: it gets a thread of its own, so that it delays no other service.
    void add_apart(std::unique_ptr<Service> service) { apart_.services.push_back(std::move(service)); }
    void start();
    /// Ends the threads. Services and client connections stay until destruction.
    void stop();

private:
    struct Loop {
        Loop();
        void wake() const;
        /// cursor: of the first pose to serve; from before the start of the thread, so that none is missed.
        void run(const PoseHub& hub, PoseHub::Cursor cursor, const std::atomic<bool>& ends);

        drivers::FileDescriptor bell;  // eventfd that wakes the thread
        std::vector<std::unique_ptr<Service>> services;
        std::thread thread;
    };

    void wake();

    PoseHub hub_;
    StylusButton button_;
    std::atomic<bool> ends_ = false;
    Loop main_;
    Loop apart_;
};

}  // namespace tricoil::host
