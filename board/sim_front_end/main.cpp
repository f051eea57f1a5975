// The `tricoil-front-end` program: a simulated front end on a real link.
#include <fmt/format.h>

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "board/command_line/parse.hpp"
#include "board/linux/device_uri.hpp"
#include "board/sim_front_end/gpio_watch.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/output_file.hpp"
#include "board/support/sim_input/peer_fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/serial/serial_port.hpp"
#include "sim/front_end/front_end.hpp"
#include "sim/usb/usbip_port.hpp"
#include "sim/world/metal_check.hpp"
#ifdef TRICOIL_WITH_CAN
#include "drivers/socketcan/can_port.hpp"
#endif

namespace tricoil::sim_front_end {
namespace {

struct Options {
    std::string link = "pty:";
    std::string scenario = "hand";
    std::uint64_t seed = 1;
    std::string mux = "tdm";
    std::string pace = "lockstep";
    std::vector<std::string> faults;
    sim::FrontEndParams front_end;
    std::string gpio;
    double hold_ms = 47;
    bool heartbeat = false;
    std::uint64_t replug_slots = 0;
    std::uint64_t replug_times = 1;
    int stalls = 0;
    std::uint64_t stall_slot = 300;
    std::string report;
    int linger_ms = 300;
    int patience_ms = 100;
    double idle_s = 300;
    bool sync = false;
    std::string calibration;
};

std::unique_ptr<hal::MessagePort> make_port(const std::string& link) {
#ifdef TRICOIL_WITH_CAN
    if (link.starts_with("can:")) {
        const auto uri = linux_board::parse_device_uri(link);
        return std::make_unique<drivers::CanPort>(drivers::CanPortParams{uri.path, uri.node, drivers::CanSide::device});
    }
#endif
    if (link == "usbip:") {
        return std::make_unique<sim::UsbIpPort>(sim::UsbIpParams{});
    }
    if (link == "pty:") {
        auto port = std::make_unique<drivers::PtyPort>();
        fmt::print("{}\n", port->path());
        std::fflush(stdout);
        return port;
    }
    throw host::InputError("--link '" + link + "': use can:INTERFACE, usbip: or pty:");
}

nlohmann::ordered_json report(const sim::SimulatedFrontEnd& device, const hal::MessagePort& port, const GpioWatch* gpio) {
    const auto c = device.counters();
    nlohmann::ordered_json json = {{"slots", c.slots},
                                   {"sent", c.sent},
                                   {"unsent", c.unsent},
                                   {"transitions", c.transitions},
                                   {"watchdogs", c.watchdogs},
                                   {"starts", c.starts},
                                   {"coils_off_after_ms", 1e-3 * static_cast<double>(c.longest_silence_us)},
                                   {"coils_on", device.coils_on()},
                                   {"link_losses", port.counters().link_losses}};
    if (gpio != nullptr) {
        const GpioReport& g = gpio->report();
        json["gpio"] = {
            {"turned_on", g.turned_on},       {"several_on", g.several_on},
            {"out_of_turn", g.out_of_turn},   {"enable_dropped_after_ms", 1e-3 * static_cast<double>(g.longest_enable_us)},
            {"lines_on_at_end", g.on_at_end}, {"enabled_at_end", g.enabled_at_end}};
    }
    return json;
}

/// Returns an empty result if the file does not exist.
std::vector<std::uint8_t> read_blob(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void keep_blob(const std::string& path, const std::vector<std::uint8_t>& blob) {
    if (!path.empty() && !blob.empty()) {
        host::write_whole_file(path, {blob.begin(), blob.end()});
    }
}

/// Serves the link until all messages are sent, nothing was measured for the idle time, or a signal comes. Opens the link again
/// if it is lost.
void serve(sim::SimulatedFrontEnd& device, hal::MessagePort& port, const Options& o, GpioWatch* gpio) {
    const host::InterruptGuard guard;
    std::optional<HostTime> finished;
    auto* const usb = dynamic_cast<sim::UsbIpPort*>(&port);
    int stalls = o.stalls;
    std::uint64_t replugs = 0;
    std::uint64_t plugged_in = 0;  // slots measured until the newest replug
    std::uint64_t seen_slots = 0;
    HostTime last_measured = drivers::host_now();
    while (!guard.interrupted()) {
        const HostTime now = drivers::host_now();
        const std::uint64_t slots = device.counters().slots;
        if (slots != seen_slots) {
            seen_slots = slots;
            last_measured = now;
        }
        if (o.idle_s > 0 && now - last_measured > microseconds_from_seconds(o.idle_s)) {
            return;
        }
        if (o.replug_slots > 0 && replugs < o.replug_times && slots - plugged_in >= o.replug_slots) {
            ++replugs;
            plugged_in = slots;
            port.close();
            ::usleep(100'000);
            (void)port.open();
        }
        if (usb != nullptr && stalls > 0 && slots >= o.stall_slot) {
            usb->stall_next(std::exchange(stalls, 0));
        }
        device.step(now);
        if (port.wait(Microseconds{0}).code() == StatusCode::device_lost && !port.open().ok()) {
            ::usleep(20'000);
        }
        if (gpio != nullptr) {
            gpio->read_lines(drivers::host_now());
        }
        finished = device.finished() && !finished ? now : finished;
        if (finished && now - *finished > Microseconds{1000 * o.linger_ms}) {
            return;
        }
    }
}

int run(Options& o) {
    using host::index_of_name;
    const auto scenario = std::make_shared<sim::Scenario>(host::load_scenario(o.scenario, o.seed));
    scenario->duration_s = o.front_end.duration_s;
    sim::check_metal(*scenario);
    o.front_end.scenario = scenario;
    o.front_end.multiplexing = host::multiplexing_of_name(o.mux);
    o.front_end.pace = index_of_name("--pace", o.pace, {"real", "lockstep"}) == 0 ? sim::Pace::real : sim::Pace::lockstep;
    for (const std::string& fault : o.faults) {
        o.front_end.faults.push_back(host::parse_peer_fault(fault));
    }
    std::optional<GpioWatch> gpio;
    if (!o.gpio.empty()) {
        gpio.emplace(o.gpio, microseconds_from_seconds(1e-3 * o.hold_ms), o.heartbeat);
        o.front_end.sense_coils = [&gpio, sync = o.sync] {
            if (sync) {  // high between two windows; no short pulse, because the simulated chip loses edges within 1 ms
                gpio->drive_sync(false);
            }
            return gpio->read_lines(drivers::host_now());
        };
    }
    if (o.sync && !gpio) {
        throw host::InputError("--sync needs --gpio: the line is on that chip");
    }
    if (o.sync) {
        o.front_end.window_over = [&gpio] { gpio->drive_sync(true); };
    }
    o.front_end.patience_us = 1000 * std::int64_t{o.patience_ms};
    o.front_end.calibration = read_blob(o.calibration);
    const auto port = make_port(o.link);
    if (!port->open().ok()) {
        throw host::DeviceError(port->detail());
    }
    sim::SimulatedFrontEnd front_end(*port, o.front_end);
    GpioWatch* const watch = gpio ? &*gpio : nullptr;
    serve(front_end, *port, o, watch);
    keep_blob(o.calibration, front_end.calibration());
    const std::string text = report(front_end, *port, watch).dump(2) + "\n";
    if (!o.report.empty()) {
        host::write_whole_file(o.report, text);
    } else {
        fmt::print("{}", text);
    }
    return 0;
}

int main_program(int argc, char** argv) {
    Options o;
    CLI::App program{"Simulate a front end on a real link", "tricoil-front-end"};
    program.add_option("--link", o.link, "can:INTERFACE[#NODE], usbip: or pty: (prints its path)")->capture_default_str();
    program.add_option("--scenario", o.scenario, "Built-in scenario or a .toml file")->capture_default_str();
    program.add_option("--mux", o.mux, "tdm, fdm or dual-band")->capture_default_str();
    program.add_option("--rate-hz", o.front_end.frame_rate_hz, "Frames per second")->capture_default_str();
    program.add_option("--seed", o.seed, "Seed of noise and motion")->capture_default_str();
    program.add_option("--duration", o.front_end.duration_s, "Simulated time to measure, s")->capture_default_str();
    program.add_option("--idle-s", o.idle_s, "Longest real time without a measurement, s; 0: no limit")
        ->check(CLI::Range(0.0, 1e6))
        ->capture_default_str();
    program.add_option("--pace", o.pace, "real, or lockstep: wait for the host")->capture_default_str();
    program.add_option("--patience-ms", o.patience_ms, "Lockstep: longest wait for the host per slot")->capture_default_str();
    program.add_option("--serial", o.front_end.serial, "Serial number")->capture_default_str();
    program.add_option("--watchdog-us", o.front_end.watchdog_us, "Silence of the host after which the coils are switched off")
        ->capture_default_str();
    program.add_option("--fault", o.faults, "NAME@FIRST-LAST, by number of message: drop, swap, twice, truncate, corrupt, ...");
    program.add_option("--gpio", o.gpio, "Simulated GPIO chip of the coil lines (its folder in sysfs)");
    program.add_option("--hold-ms", o.hold_ms, "Time for which the hardware enable stays on after a heartbeat")
        ->capture_default_str();
    program.add_flag("--heartbeat", o.heartbeat, "Model the hardware enable: coils off without heartbeats");
    program.add_flag("--sync", o.sync, "Pulse line 4 of the chip at the end of each window");
    program.add_option("--calibration", o.calibration, "Flash file: the calibration is read at the start and written at the end");
    program.add_flag("--fail-self-check", o.front_end.fails_self_check, "Report a failed self-check");
    program.add_flag("--locked", o.front_end.is_locked,
                     "Refuse loader and calibration commands, like a board whose button nobody presses");
    program.add_option("--replug", o.replug_slots, "Number of slots after which the device is unplugged and plugged in again");
    program.add_option("--replug-times", o.replug_times, "Number of replugs")->capture_default_str();
    program.add_option("--stall", o.stalls, "usbip: number of transfers that stall");
    program.add_option("--stall-slot", o.stall_slot, "Number of slots before the stall")->capture_default_str();
    program.add_option("--linger-ms", o.linger_ms, "Time for which the link stays open after the last slot")
        ->capture_default_str();
    program.add_option("--report", o.report, "Write the final report to this file");
    return host::parse_command_line(program, argc, argv) ? run(o) : to_int(host::ExitCode::fine);
}

}  // namespace
}  // namespace tricoil::sim_front_end

int main(int argc, char** argv) {
    return tricoil::host::exit_code_of("tricoil-front-end", [&] { return tricoil::sim_front_end::main_program(argc, argv); });
}
