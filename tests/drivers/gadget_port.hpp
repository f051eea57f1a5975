// USB function of the kernel's gadget stack, through FunctionFS.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/protocol/stream_framing.hpp"
#include "sim/usb/peer_port.hpp"

namespace tricoil::sim {

struct GadgetParams {
    std::string function = "/run/gadget";  // mount point of functionfs
    std::string gadget;                    // the gadget's folder in configfs
    std::string controller = "dummy_udc.0";
};

/// open() writes the descriptors and binds the gadget to its controller; close() unbinds it, which the host sees as unplugged.
/// Reading and writing the endpoints block, so each has its own thread.
class GadgetPort final : public PeerPort {
public:
    explicit GadgetPort(GadgetParams params) : params_(std::move(params)) {}
    ~GadgetPort() override { do_close(); }

private:
    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override;

    bool bind(const std::string& controller);
    void start(void (GadgetPort::*serve)());
    void serve_control();
    void read_endpoint();
    void write_endpoint();
    Status fail(const char* what);

    GadgetParams params_;
    int control_ = -1;
    int in_ = -1;
    int out_ = -1;
    std::vector<std::thread> threads_;
    std::atomic<bool> ending_{false};
    std::atomic<int> running_{0};
    std::mutex mutex_;
    std::condition_variable arrived_;
    std::condition_variable to_send_;
    std::deque<std::vector<std::uint8_t>> outgoing_;
};

}  // namespace tricoil::sim
