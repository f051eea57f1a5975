// tricoil doctor: checks what devices and outputs need on this machine.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/socket.h>
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
        "sudo cp board/linux/system/70-tricoil.rules /etc/udev/rules.d/ && sudo udevadm control --reload, then reconnect "
        "the device");
}

Json check_group(const char* group, const char* use) {
    const std::string name = std::string("group ") + group;
    const struct group* const found = ::getgrnam(group);
    if (found == nullptr) {
        return passed(name, "does not exist on this system");
    }
    std::vector<gid_t> mine(static_cast<std::size_t>(std::max(::getgroups(0, nullptr), 0)));
    mine.resize(static_cast<std::size_t>(std::max(::getgroups(static_cast<int>(mine.size()), mine.data()), 0)));
    if (::geteuid() == 0 || std::ranges::find(mine, found->gr_gid) != mine.end()) {
        return passed(name, ::geteuid() == 0 ? "not needed by root" : "member");
    }
    return failed(name, std::string("you are not a member: no access to ") + use,
                  fmt::format("sudo usermod -aG {} $USER, then log in again", group));
}

/// CAN interfaces, which must be up and carry CAN FD, and USB devices.
void check_devices(Json& checks) {
    for (const Json& device : linux_board::connected_devices()) {
        const std::string uri = device["uri"];
        if (!device.contains("fd")) {
            checks.push_back(passed(uri, device["product"]));
            continue;
        }
        const std::string interface = uri.substr(uri.find(':') + 1);
        std::string flags;
        std::ifstream("/sys/class/net/" + interface + "/flags") >> flags;
        const bool is_up = (std::strtoul(flags.c_str(), nullptr, 16) & 1U) != 0;
        checks.push_back(
            is_up && device["fd"]
                ? passed(uri, "up, CAN FD")
                : failed(
                      uri, is_up ? "classic CAN; messages need CAN FD" : "down",
                      fmt::format("sudo ip link set {0} down; sudo ip link set {0} up type can bitrate 1000000 dbitrate 5000000 "
                                  "fd on",
                                  interface)));
    }
}

void check_serial_ports(Json& checks) {
    std::error_code ignored;
    for (const auto& file : fs::directory_iterator("/dev", ignored)) {
        const std::string name = file.path().filename();
        if (name.starts_with("ttyACM") || name.starts_with("ttyUSB")) {
            const bool is_open = ::access(file.path().c_str(), R_OK | W_OK) == 0;
            checks.push_back(is_open ? passed("serial:" + file.path().string(), "readable and writable")
                                     : failed("serial:" + file.path().string(), "no permission",
                                              "sudo usermod -aG dialout $USER, then log in again"));
        }
    }
}

Json check_port() {
    const std::string name = fmt::format("port {}", kLivePage);
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(kLivePage);
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const bool is_free = ::bind(socket, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0;
    ::close(socket);
    return is_free ? passed(name, "free for the live page")
                   : failed(name, "used by another program", "give the live page another port: tricoil serve --web PORT");
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
    checks.push_back(check_group("plugdev", "USB devices"));
    checks.push_back(check_group("dialout", "serial ports"));
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
