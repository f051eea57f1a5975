#include "board/linux/device_list.hpp"

#include <fmt/format.h>
#include <net/if.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "board/support/errors.hpp"
#ifdef TRICOIL_WITH_USB
#include "drivers/libusb/usb_device.hpp"
#endif

namespace tricoil::linux_board {
namespace {

using host::Json;

constexpr int kArphrdCan = 280;

/// CAN interfaces of the kernel. The MTU shows CAN FD.
Json can_interfaces() {
    Json found = Json::array();
    struct if_nameindex* const all = ::if_nameindex();
    if (all == nullptr) {
        throw host::DeviceError(std::string("network interfaces cannot be listed (") + std::strerror(errno) + ")");
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
#ifdef TRICOIL_WITH_USB
    const drivers::UsbAddress any;
    for (const auto& usb : drivers::list_usb(any.vendor, any.product)) {
        std::string uri = fmt::format("usb:{:04x}:{:04x}", any.vendor, any.product);
        uri += usb.serial.empty() ? "" : ":" + usb.serial;
        all.push_back({{"uri", uri}, {"product", usb.product}});
    }
#endif
    return all;
}

}  // namespace tricoil::linux_board
