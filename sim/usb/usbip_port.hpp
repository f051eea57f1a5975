// USB device emulated by this program, plugged into the kernel's virtual host controller.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/protocol/stream_framing.hpp"
#include "sim/usb/peer_port.hpp"
#include "sim/usb/usbip_wire.hpp"

namespace tricoil::sim {

struct UsbIpParams {
    std::uint16_t vendor = 0x1209;
    std::uint16_t product = 0x0001;
    std::string serial = "SIM0001";
};

/// open() plugs the device in, close() unplugs it. Vendor class, one interface, bulk endpoints 0x81 and 0x01 of 512 bytes.
class UsbIpPort final : public PeerPort {
public:
    explicit UsbIpPort(UsbIpParams params)
        : params_(std::move(params)),
          wire_([this](const UsbIpRequest& request, std::span<const std::uint8_t> data) { handle(request, data); },
                [this](std::uint32_t victim) { return unlink(victim); }) {}

    /// The next `transfers` transfers to the host are answered with a stall.
    void stall_next(int transfers) { stalls_ = transfers; }
    /// Sends one packet unchanged, framed or not.
    void send_packet(std::vector<std::uint8_t> bytes);
    /// While hung, the device takes nothing from the host and delivers nothing: the host's transfers time out.
    void hang(bool hung) { hung_ = hung; }

private:
    struct Pending {
        std::uint32_t number = 0;
        std::uint32_t length = 0;
    };

    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override;

    void handle(const UsbIpRequest& request, std::span<const std::uint8_t> data);
    void control(const UsbIpRequest& request);
    bool unlink(std::uint32_t victim);
    void deliver();

    UsbIpParams params_;
    UsbIpWire wire_;
    std::deque<Pending> pending_;
    std::deque<std::uint32_t> withheld_;  // numbers of the host's transfers while hung
    std::deque<std::vector<std::uint8_t>> packets_;
    protocol::StreamReader reader_;
    int stalls_ = 0;
    bool hung_ = false;
};

}  // namespace tricoil::sim
