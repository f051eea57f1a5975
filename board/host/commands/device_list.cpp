#include "board/host/commands/device_list.hpp"

#include <fmt/format.h>
#include <net/if.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "board/support/errors.hpp"
#include "drivers/libusb/usb_device.hpp"

namespace tricoil::host {
namespace {

constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0x0001;
constexpr int kArphrdCan = 280;

/// CAN interfaces of the kernel. The MTU shows CAN FD.
Json can_interfaces() {
    Json found = Json::array();
    struct if_nameindex* const all = ::if_nameindex();
    if (all == nullptr) {
        throw DeviceError(std::string("network interfaces cannot be listed (") + std::strerror(errno) + ")");
    }
    for (struct if_nameindex* i = all; i->if_index != 0; ++i) {
        const std::string folder = std::string("/sys/class/net/") + i->if_name;
        int type = 0;
        int mtu = 0;
        std::ifstream(folder + "/type") >> type;
        std::ifstream(folder + "/mtu") >> mtu;
        if (type == kArphrdCan) {
            found.push_back({{"uri", std::string("can:") + i->if_name}, {"fd", mtu >= 72}});
        }
    }
    ::if_freenameindex(all);
    return found;
}

}  // namespace

Json connected_devices() {
    Json all = can_interfaces();
    for (const auto& usb : drivers::list_usb(kVendor, kProduct)) {
        std::string uri = fmt::format("usb:{:04x}:{:04x}", kVendor, kProduct);
        uri += usb.serial.empty() ? "" : ":" + usb.serial;
        all.push_back({{"uri", uri}, {"product", usb.product}});
    }
    return all;
}

}  // namespace tricoil::host
