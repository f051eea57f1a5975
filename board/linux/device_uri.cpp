#include "board/linux/device_uri.hpp"

#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"
#include "drivers/serial/serial_port.hpp"
#ifdef TRICOIL_WITH_CAN
#include "drivers/socketcan/can_port.hpp"
#endif
#ifdef TRICOIL_WITH_USB
#include "drivers/libusb/usb_port.hpp"
#endif

namespace tricoil::linux_board {
namespace {

constexpr const char* kForms =
    "use sim:, can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL] or serial:PATH; in run and serve also columns:WHERE, "
    "couplings:WHERE or poses:WHERE";

/// Parses all of `text` as a number in this base, at most `most`.
std::uint16_t number(const std::string& text, int base, unsigned most, const std::string& uri, const char* what) {
    const auto value = host::number_from<unsigned>(text, base);
    if (!value || *value > most) {
        throw host::InputError("device '" + uri + "': '" + text + "' is not a valid " + what + "; " + kForms);
    }
    return static_cast<std::uint16_t>(*value);
}

}  // namespace

DeviceUri parse_device_uri(const std::string& text) {
    const auto colon = text.find(':');
    const std::string scheme = text.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    host::refuse_if(scheme == "sim",
                    "device '{}': the simulated device is 'sim:', only in tricoil run and serve, with --scenario", text);
    host::refuse_if(rest.empty() || (scheme != "can" && scheme != "usb" && scheme != "serial"), "unknown device '{}'; {}", text,
                    kForms);
    DeviceUri uri;
    if (scheme == "can") {
        require(host::Component::can, "device '" + text + "'");
        const auto hash = rest.find('#');
        uri.path = rest.substr(0, hash);
        if (hash != std::string::npos) {
            uri.node = static_cast<std::uint8_t>(number(rest.substr(hash + 1), 10, 15, text, "node number, 0 to 15"));
        }
    } else if (scheme == "serial") {
        uri.kind = LinkKind::serial;
        uri.path = rest;
    } else {
        require(host::Component::usb, "device '" + text + "'");
        uri.kind = LinkKind::usb;
        const auto second = rest.find(':');
        const auto third = second == std::string::npos ? second : rest.find(':', second + 1);
        const std::string product = second == std::string::npos ? "" : rest.substr(second + 1, third - second - 1);
        uri.vendor = number(rest.substr(0, second), 16, 0xFFFF, text, "vendor number of four hexadecimal digits");
        uri.product = number(product, 16, 0xFFFF, text, "product number of four hexadecimal digits");
        uri.serial = third == std::string::npos ? "" : rest.substr(third + 1);
    }
    return uri;
}

std::unique_ptr<hal::MessagePort> make_port(const DeviceUri& uri) {
#ifdef TRICOIL_WITH_CAN
    if (uri.kind == LinkKind::can) {
        return std::make_unique<drivers::CanPort>(drivers::CanPortParams{uri.path, uri.node, drivers::CanSide::host});
    }
#endif
#ifdef TRICOIL_WITH_USB
    if (uri.kind == LinkKind::usb) {
        return std::make_unique<drivers::UsbPort>(drivers::UsbAddress{uri.vendor, uri.product, uri.serial});
    }
#endif
    return std::make_unique<drivers::SerialPort>(uri.path);
}

}  // namespace tricoil::linux_board
