#include "drivers/libusb/usb_device.hpp"

#include <array>
#include <span>

namespace tricoil::drivers {
namespace {

constexpr int kInterface = 0;

constexpr Status lost() { return {StatusCode::device_lost, "USB device is not usable"}; }

std::string text_of(libusb_device_handle* handle, std::uint8_t index) {
    std::array<unsigned char, 128> text{};
    const int size = index == 0 ? 0 : libusb_get_string_descriptor_ascii(handle, index, text.data(), text.size());
    return {text.begin(), text.begin() + std::max(size, 0)};
}

/// Calls visit(device, descriptor) for each matching device until it returns true.
template <typename Visitor>
void visit_devices(libusb_context* context, std::uint16_t vendor, std::uint16_t product, Visitor visit) {
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    for (libusb_device* device : std::span(list, count > 0 ? static_cast<std::size_t>(count) : 0)) {
        libusb_device_descriptor descriptor{};
        const bool ours = libusb_get_device_descriptor(device, &descriptor) == 0 && descriptor.idVendor == vendor &&
                          descriptor.idProduct == product;
        if (ours && visit(device, descriptor)) {
            break;
        }
    }
    if (list != nullptr) {
        libusb_free_device_list(list, 1);
    }
}

bool find_endpoints(UsbDevice& device) {
    libusb_config_descriptor* config = nullptr;
    if (libusb_get_active_config_descriptor(libusb_get_device(device.handle.get()), &config) != 0) {
        return false;
    }
    if (config->bNumInterfaces > kInterface && config->interface[kInterface].num_altsetting > 0) {
        const libusb_interface_descriptor& setting = config->interface[kInterface].altsetting[0];
        for (const libusb_endpoint_descriptor& endpoint : std::span(setting.endpoint, setting.bNumEndpoints)) {
            if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) {
                continue;
            }
            const bool is_in = (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0;
            (is_in ? device.in : device.out) = endpoint.bEndpointAddress;
            device.packet_bytes = is_in ? endpoint.wMaxPacketSize : device.packet_bytes;
        }
    }
    libusb_free_config_descriptor(config);
    return device.in != 0 && device.out != 0 && device.packet_bytes > 0;
}

void explain(const UsbAddress& address, int error, const char* doing, Text& reason) {
    const char* remedy = "";
    if (error == LIBUSB_ERROR_ACCESS) {
        remedy = ": no permission; install board/linux/system/70-tricoil.rules in /etc/udev/rules.d and plug the device in again";
    } else if (error == LIBUSB_ERROR_BUSY) {
        remedy = ": another program uses it";
    } else if (error == LIBUSB_ERROR_NO_DEVICE) {
        remedy = ": it was unplugged";
    }
    reason.print("USB device %04x:%04x: %s failed (%s)%s", address.vendor, address.product, doing, libusb_error_name(error),
                 remedy);
}

/// Opens the first matching device. Returns the error of the last device that failed to open; LIBUSB_ERROR_NOT_FOUND if there is
/// none.
int open_matching(const UsbAddress& address, UsbDevice& device) {
    int error = LIBUSB_ERROR_NOT_FOUND;
    visit_devices(device.context.get(), address.vendor, address.product,
                  [&](libusb_device* candidate, const libusb_device_descriptor& descriptor) {
                      libusb_device_handle* handle = nullptr;
                      const int opened = libusb_open(candidate, &handle);
                      if (opened != 0) {
                          error = opened;
                          return false;
                      }
                      UsbHandle owned(handle);
                      if (!address.serial.empty() && text_of(handle, descriptor.iSerialNumber) != address.serial) {
                          return false;
                      }
                      device.handle = std::move(owned);
                      error = 0;
                      return true;
                  });
    return error;
}

}  // namespace

Status open_usb(const UsbAddress& address, UsbDevice& device, Text& reason) {
    device.close();
    device.in = device.out = 0;
    libusb_context* context = nullptr;
    if (const int error = libusb_init(&context); error != 0) {
        reason.print("USB is not available (%s)", libusb_error_name(error));
        return lost();
    }
    device.context.reset(context);
    if (const int error = open_matching(address, device); error == LIBUSB_ERROR_NOT_FOUND) {
        reason.print("USB device %04x:%04x%s%s: not found; is it plugged in? see: lsusb", address.vendor, address.product,
                     address.serial.empty() ? "" : " with serial number ", address.serial.c_str());
        return lost();
    } else if (error != 0) {
        explain(address, error, "opening", reason);
        return lost();
    }
    libusb_set_auto_detach_kernel_driver(device.handle.get(), 1);
    if (const int error = libusb_claim_interface(device.handle.get(), kInterface); error != 0) {
        explain(address, error, "claiming its interface", reason);
        return lost();
    }
    if (!find_endpoints(device)) {
        reason.print("USB device %04x:%04x: no pair of bulk endpoints; this is not a tricoil device", address.vendor,
                     address.product);
        return lost();
    }
    return {};
}

std::vector<UsbListing> list_usb(std::uint16_t vendor, std::uint16_t product) {
    std::vector<UsbListing> found;
    libusb_context* raw = nullptr;
    if (libusb_init(&raw) != 0) {
        return found;
    }
    const UsbContext context(raw);
    visit_devices(raw, vendor, product, [&](libusb_device* device, const libusb_device_descriptor& descriptor) {
        UsbListing listing{libusb_get_bus_number(device), libusb_get_device_address(device), "", ""};
        libusb_device_handle* handle = nullptr;
        if (libusb_open(device, &handle) == 0) {
            const UsbHandle owned(handle);
            listing.serial = text_of(handle, descriptor.iSerialNumber);
            listing.product = text_of(handle, descriptor.iProduct);
        }
        found.push_back(listing);
        return false;
    });
    return found;
}

}  // namespace tricoil::drivers
