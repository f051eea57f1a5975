// Finds a USB device and opens its pair of bulk endpoints.
#pragma once

#include <libusb.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/status.hpp"
#include "core/protocol/usb_id.hpp"
#include "drivers/posix/text.hpp"

namespace tricoil::drivers {

struct UsbAddress {
    std::uint16_t vendor = protocol::kUsbVendor;
    std::uint16_t product = protocol::kUsbProduct;
    std::string serial;  // empty: any; the first device is used
};

struct UsbContextCloser {
    void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct UsbHandleCloser {
    void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
using UsbContext = std::unique_ptr<libusb_context, UsbContextCloser>;
using UsbHandle = std::unique_ptr<libusb_device_handle, UsbHandleCloser>;

/// An open device with interface 0 claimed. Members are destroyed in the right order.
struct UsbDevice {
    UsbContext context;
    UsbHandle handle;
    std::uint8_t in = 0;  // endpoint addresses
    std::uint8_t out = 0;
    int packet_bytes = 64;  // of the incoming endpoint

    void close() {  // handle before context; an assignment would destroy the context first
        handle.reset();
        context.reset();
    }
};

/// device_lost, with the reason in `reason`: not found, no permission, in use, or without bulk endpoints.
Status open_usb(const UsbAddress& address, UsbDevice& device, Text& reason);

struct UsbListing {
    std::uint8_t bus = 0;
    std::uint8_t address = 0;
    std::string serial;  // empty: not readable
    std::string product;
};

/// Lists the devices of a vendor and product.
std::vector<UsbListing> list_usb(std::uint16_t vendor, std::uint16_t product);

}  // namespace tricoil::drivers
