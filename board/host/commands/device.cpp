// tricoil device: which devices there are, who one is, and what it says.
#include <fmt/format.h>
#include <net/if.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "board/host/commands/commands.hpp"
#include "board/host/errors.hpp"
#include "board/host/interrupt.hpp"
#include "board/linux/device_session.hpp"
#include "board/linux/device_uri.hpp"
#include "drivers/libusb/usb_device.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {
namespace {

using linux_board::DeviceSession;
using nlohmann::ordered_json;

constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0x0001;
constexpr int kArphrdCan = 280;

struct DeviceCommand {
    std::string uri;
    double wait_s = 2;
    double duration_s = 0;
    bool json = false;
};

/// CAN interfaces, by the kernel's list; FD by their MTU.
ordered_json can_interfaces() {
    ordered_json found = ordered_json::array();
    struct if_nameindex* const all = ::if_nameindex();
    for (struct if_nameindex* i = all; i != nullptr && i->if_index != 0; ++i) {
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

int list_devices(const DeviceCommand& command) {
    ordered_json all = can_interfaces();
    for (const auto& usb : drivers::list_usb(kVendor, kProduct)) {
        std::string uri = fmt::format("usb:{:04x}:{:04x}", kVendor, kProduct);
        uri += usb.serial.empty() ? "" : ":" + usb.serial;
        all.push_back({{"uri", uri}, {"product", usb.product}});
    }
    if (command.json) {
        fmt::print("{}\n", all.dump(2));
        return to_int(ExitCode::fine);
    }
    for (const auto& device : all) {
        const std::string note = device.contains("fd")
                                     ? (device["fd"].get<bool>() ? "CAN FD" : "classic CAN: of no use here; enable FD")
                                     : device["product"].get<std::string>();
        fmt::print("{:<32} {}\n", device["uri"].get<std::string>(), note);
    }
    if (all.empty()) {
        fmt::print("no CAN interface and no tricoil USB device is there\n");
    }
    return to_int(ExitCode::fine);
}

/// Greets the device and calls each(message) until it returns false, `seconds` are over (0: never) or a signal comes.
template <typename Each>
void converse(hal::MessagePort& port, DeviceSession& session, double seconds, Each each) {
    const InterruptGuard guard;
    const std::int64_t begin = drivers::monotonic_us();
    bool going = true;
    while (going && !guard.interrupted()) {
        const std::int64_t now = drivers::monotonic_us();
        if (seconds > 0 && static_cast<double>(now - begin) > 1e6 * seconds) {
            return;
        }
        session.service(now);
        hal::ReceivedMessage message;
        if (port.wait(Microseconds{5000}).code() == StatusCode::device_lost) {
            session.on_device_lost(now);
            ::timespec pause{0, 5'000'000};
            ::nanosleep(&pause, nullptr);
            continue;
        }
        while (going && port.receive(message).ok()) {
            session.take(message);
            going = each(message);
        }
    }
}

linux_board::SessionParams listening() {
    linux_board::SessionParams params;
    params.start = false;
    params.any_coils = true;
    return params;
}

ordered_json identity_json(const protocol::IdentifyMessage& m) {
    return {{"role", m.role == 1 ? "front end" : "tracker"},
            {"serial", m.serial},
            {"firmware", fmt::format("{}.{}.{}", m.firmware >> 16U, m.firmware >> 8U & 0xFFU, m.firmware & 0xFFU)},
            {"protocol", {m.oldest_version, m.newest_version}},
            {"sensors", m.sensors},
            {"multiplexing", m.multiplexing == 0 ? "tdm" : "fdm"},
            {"drives_coils", m.drives_coils != 0},
            {"frame_rate_hz", 1e-3 * m.frame_rate_mhz},
            {"window_s", 1e-6 * m.window_us},
            {"watchdog_s", 1e-6 * m.watchdog_us}};
}

int show_info(const DeviceCommand& command) {
    const auto port = linux_board::make_port(linux_board::parse_device_uri(command.uri));
    DeviceSession session(*port, listening());
    converse(*port, session, command.wait_s, [&](const hal::ReceivedMessage&) { return !session.has_identity(); });
    if (!session.has_identity()) {
        throw DeviceError(fmt::format("{}: {}", command.uri, session.detail()));
    }
    const ordered_json identity = identity_json(session.identity());
    if (command.json) {
        fmt::print("{}\n", identity.dump(2));
        return to_int(ExitCode::fine);
    }
    for (const auto& [key, value] : identity.items()) {
        fmt::print("{:<14} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
    }
    return to_int(ExitCode::fine);
}

/// One line a message, with the first fields that every message has.
void print_message(const hal::ReceivedMessage& message, bool json) {
    std::string line;
    protocol::for_each_message([&](auto schema) {
        if (static_cast<std::uint8_t>(schema.kInfo.type) != message.bytes[1] || message.bytes.size() < fixed_bytes(schema)) {
            return;
        }
        ordered_json fields = {{"message", schema.kInfo.name}};
        protocol::for_each_field(schema, [&](const char* name, const protocol::FieldInfo& f, std::size_t at) {
            const std::uint8_t* const bytes = message.bytes.data() + at;
            fields[name] = f.type == protocol::WireType::f32
                               ? static_cast<double>(protocol::get<float>(bytes, f.type))
                               : f.scale * static_cast<double>(protocol::get<std::int64_t>(bytes, f.type));
        });
        line = json ? fields.dump() : fmt::format("{:<10} {}", schema.kInfo.name, fields.dump().substr(0, 110));
    });
    if (!line.empty()) {
        fmt::print("{}\n", line);
    }
}

int watch(const DeviceCommand& command) {
    const auto port = linux_board::make_port(linux_board::parse_device_uri(command.uri));
    DeviceSession session(*port, listening());
    std::uint64_t shown = 0;
    converse(*port, session, command.duration_s, [&](const hal::ReceivedMessage& message) {
        print_message(message, command.json);
        ++shown;
        return true;
    });
    if (shown == 0) {
        throw DeviceError(fmt::format("{}: {}", command.uri, session.detail()));
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_device_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<DeviceCommand>();
    CLI::App* sub = program.add_subcommand("device", "Front ends and tracker boards: which there are, who one is, what it says");
    sub->require_subcommand(1);
    const auto add = [&](const char* name, const char* what, int (*act)(const DeviceCommand&)) {
        CLI::App* const one = sub->add_subcommand(name, what);
        one->add_flag("--json", command->json, "As JSON");
        one->callback([command, act, &action] { action = [command, act] { return act(*command); }; });
        return one;
    };
    add("list", "CAN interfaces and USB devices of this machine", &list_devices);
    CLI::App* const info = add("info", "Ask a device who it is", &show_info);
    info->add_option("device", command->uri, "can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL] or serial:PATH")->required();
    info->add_option("--wait", command->wait_s, "Seconds to wait for its answer")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    CLI::App* const watched = add("watch", "Print every message of a device, leaving it as it is", &watch);
    watched->add_option("device", command->uri, "can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL] or serial:PATH")->required();
    watched->add_option("--duration", command->duration_s, "Seconds; default: until a signal comes")->check(CLI::PositiveNumber);
}

}  // namespace tricoil::host
