// Device names: can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL], serial:PATH.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "hal/message_port.hpp"

namespace tricoil::linux_board {

enum class LinkKind : std::uint8_t { can, usb, serial };

struct DeviceUri {
    LinkKind kind = LinkKind::can;
    std::string path;  // interface or tty
    std::uint8_t node = 0;
    std::uint16_t vendor = 0;
    std::uint16_t product = 0;
    std::string serial;
};

/// Throws InputError that names the error in `text`.
DeviceUri parse_device_uri(const std::string& text);

/// Creates the host's end of the link. It is not open yet.
std::unique_ptr<hal::MessagePort> make_port(const DeviceUri& uri);

}  // namespace tricoil::linux_board
