// tricoil doctor: checks what devices and outputs need on this machine.
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/user_defaults.hpp"
#include "board/linux/device_list.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/tcp_listener.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr int kLivePage = 8080;  // port of the examples

Json passed(const std::string& name, const std::string& found) { return {{"name", name}, {"ok", true}, {"found", found}}; }

Json failed(const std::string& name, const std::string& found, const std::string& mend) {
    return {{"name", name}, {"ok", false}, {"found", found}, {"mend", mend}};
}

Json check_component(Component component, const std::string& name) {
    try {
        require(component, name);
    } catch (const InputError& error) {
        return failed(name, "not built", error.what());
    }
    return passed(name, "built");
}

Json check_defaults() {
    try {
        const std::string path = read_user_defaults().path;
        return passed("defaults", path.empty() ? "no ~/.config/tricoil.toml" : path);
    } catch (const std::exception& error) {
        return failed("defaults", error.what(), "correct or delete the file");
    }
}

Json check_rules() {
    for (const char* folder : {"/etc", "/usr/lib", "/lib", "/run"}) {
        if (const std::string path = std::string(folder) + "/udev/rules.d/70-tricoil.rules"; fs::exists(path)) {
            return passed("udev rules", path);
        }
    }
    return failed(
        "udev rules", "70-tricoil.rules is not installed",
        "install the Debian package, or from the source tree: sudo cp board/linux/system/70-tricoil.rules /etc/udev/rules.d/ && "
        "sudo udevadm control --reload; then reconnect the device");
}

Json check_can(const std::string& uri, bool has_fd) {
    const std::string interface = uri.substr(uri.find(':') + 1);
    const std::string folder = "/sys/class/net/" + interface;
    std::string flags;
    std::ifstream(folder + "/flags") >> flags;
    const bool is_up = (std::strtoul(flags.c_str(), nullptr, 16) & 1U) != 0;
    if (is_up && has_fd) {
        return passed(uri, "up, CAN FD");
    }
    const char* const settings = fs::exists(folder + "/device") ? "type can bitrate 1000000 dbitrate 5000000 fd on" : "mtu 72";
    return failed(uri, is_up ? "classic CAN; messages need CAN FD" : "down",
                  fmt::format("sudo ip link set {0} down; sudo ip link set {0} up {1}", interface, settings));
}

/// CAN interfaces, which must be up and carry CAN FD, and USB devices. One that cannot be opened tells no name.
void check_devices(Json& checks) {
    for (const Json& device : linux_board::connected_devices()) {
        const std::string uri = device["uri"];
        if (device.contains("fd")) {
            checks.push_back(check_can(uri, device["fd"]));
        } else if (const std::string product = device["product"]; product.empty()) {
            checks.push_back(failed(uri, "cannot be opened", "install the udev rules, then reconnect the device"));
        } else {
            checks.push_back(passed(uri, product));
        }
    }
}

/// Name of the group that may use a file.
std::string group_of(const std::string& path) {
    struct stat status {};
    const struct group* const found = ::stat(path.c_str(), &status) == 0 ? ::getgrgid(status.st_gid) : nullptr;
    return found == nullptr ? "dialout" : found->gr_name;
}

void check_serial_ports(Json& checks) {
    std::error_code ignored;
    for (const auto& file : fs::directory_iterator("/dev", ignored)) {
        const std::string path = file.path();
        if (path.starts_with("/dev/ttyACM") || path.starts_with("/dev/ttyUSB")) {
            checks.push_back(::access(path.c_str(), R_OK | W_OK) == 0
                                 ? passed("serial:" + path, "readable and writable")
                                 : failed("serial:" + path, "no permission",
                                          fmt::format("sudo usermod -aG {} $USER, then log in again", group_of(path))));
        }
    }
}

/// The live page may have another port, so a port in use is no failure.
Json check_port() {
    std::string found = "free";
    try {
        (void)TcpListener("--web", {"127.0.0.1", fmt::format("{}", kLivePage)});
    } catch (const DeviceError&) {
        found = "used by another program or by tricoil.service; tricoil serve --web PORT takes another";
    } catch (const InputError& error) {
        found = error.what();
    }
    return passed(fmt::format("port {}", kLivePage), found);
}

std::string doctor_text(const Json& result) {
    std::string text;
    for (const Json& check : result["checks"]) {
        text += fmt::format("{:<4} {}: {}\n", check["ok"] ? "ok" : "FAIL", check["name"].get<std::string>(),
                            check["found"].get<std::string>());
        text += check.contains("mend") ? "       " + check["mend"].get<std::string>() + "\n" : "";
    }
    return text;
}

int run_doctor(bool json) {
    Json checks = Json::array();
    checks.push_back(passed("version", "tricoil " TRICOIL_VERSION));
    checks.push_back(check_component(Component::can, "CAN"));
    checks.push_back(check_component(Component::usb, "USB"));
    checks.push_back(check_defaults());
    checks.push_back(check_rules());
    check_devices(checks);
    check_serial_ports(checks);
    checks.push_back(check_port());
    const bool is_fine = std::ranges::all_of(checks, [](const Json& check) { return check["ok"].get<bool>(); });
    print_result({{"ok", is_fine}, {"checks", checks}}, json, doctor_text);
    return to_int(is_fine ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_doctor_command(CLI::App* sub, Action& action) {
    auto json = std::make_shared<bool>(false);
    sub->add_flag("--json", *json, "Result as JSON");
    set_examples(sub, {{"why does my device not work?", "tricoil doctor"}});
    sub->callback([json, &action] { action = [json] { return run_doctor(*json); }; });
}

}  // namespace tricoil::host
