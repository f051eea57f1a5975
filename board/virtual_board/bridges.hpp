// Bridges between the virtual board's links and the real interfaces of this machine.
#pragma once

#include <string>
#include <vector>

#include "core/base/interface.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/socketcan/can_socket.hpp"
#include "sim/usb/usbip_wire.hpp"
#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {

/// Moves pending data in both directions; never waits. Throws host::DeviceError if its interface is lost.
class Bridge : public Interface {
public:
    virtual void serve() = 0;
};

/// Serial line on a pseudo terminal.
class SerialBridge final : public Bridge {
public:
    explicit SerialBridge(SerialLine& line);
    [[nodiscard]] const std::string& path() const { return path_; }
    void serve() override;

private:
    SerialLine& line_;
    drivers::FileDescriptor master_;
    drivers::FileDescriptor slave_;  // kept open: otherwise the master hangs up while no other program has the slave open
    std::string path_;
    std::vector<std::uint8_t> unsent_;
};

/// CAN bus on a CAN FD interface of the kernel.
class CanBridge final : public Bridge {
public:
    CanBridge(CanWire& wire, const std::string& interface);
    void serve() override;

private:
    CanWire& wire_;
    drivers::CanSocket socket_;
};

/// USB plug at the kernel's virtual host controller.
class UsbBridge final : public Bridge {
public:
    /// Throws host::DeviceError if there is no such controller.
    explicit UsbBridge(UsbWire& wire);
    void serve() override;

private:
    void submit(const sim::UsbIpRequest& request, std::span<const std::uint8_t> data);

    UsbWire& wire_;
    sim::UsbIpWire kernel_;
    enum class State : std::uint8_t { out, resetting, ready, in } state_ = State::out;
};

}  // namespace tricoil::virtual_board
