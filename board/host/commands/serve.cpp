// tricoil serve: track, and let other programs have the poses.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "board/host/commands/commands.hpp"
#include "board/host/commands/run_command.hpp"
#include "board/host/serve/fastrak/fastrak_output.hpp"
#include "board/host/serve/openigtlink/igtl_session.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/server.hpp"
#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/web/page_text.hpp"
#include "board/host/serve/web/web_server.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr double kEndless_s = 1e9;

struct ServeCommand {
    std::shared_ptr<RunCommand> run = std::make_shared<RunCommand>();
    std::vector<std::string> fastrak;
    bool fastrak_continuous = false;
    std::string openigtlink;
    std::string web;
    std::string record_folder;
};

using Addresses = nlohmann::ordered_json;

void add_outputs(const ServeCommand& command, Server& server, TrackerControl& control, Addresses& addresses) {
    for (const std::string& where : command.fastrak) {
        auto output = fastrak::make_output(where, command.fastrak_continuous, server.hub(), control);
        addresses["fastrak"].push_back(output.address);
        server.add(std::move(output.service));
    }
    if (!command.openigtlink.empty()) {
        constexpr const char* kOption = "--openigtlink";
        const TcpAddress address = parse_tcp_address(kOption, command.openigtlink);
        auto service = std::make_unique<TcpService<igtl_output::Session>>(kOption, address, [&server](Stream& stream) {
            auto session = std::make_unique<igtl_output::Session>(stream);
            session->remember(server.hub().newest());
            return session;
        });
        addresses["openigtlink"] = address.text(service->port());
        server.add(std::move(service));
    }
}

/// Where clients find us, before the first pose: a program that starts us waits for this line.
void announce(const Addresses& addresses, bool json) {
    if (json) {
        fmt::print("{}\n", addresses.dump());
    } else {
        for (const auto& [name, address] : addresses.items()) {
            fmt::print("serving {} on {}\n", name,
                       address.is_array() ? fmt::format("{}", fmt::join(address.get<std::vector<std::string>>(), ", "))
                                          : address.get<std::string>());
        }
    }
    std::fflush(stdout);
}

/// Hands the clients' wishes to whichever loop runs; one for a sensor that is not there, or not finite, is in vain.
auto carry_out(TrackerControl& control) {
    return [&control](auto& loop) {
        for (const auto& wish : control.take()) {
            (void)loop.set_hemisphere(wish.sensor, wish.towards);
        }
    };
}

int serve_simulation(RunCommand& run, hal::TrackerTap<double>& tap, TrackerControl& control) {
    complete_simulation_options(run);
    run.options.realtime = true;
    run.options.duration_s = run.options.duration_s.value_or(kEndless_s);
    RunCompany company;
    company.tap = &tap;
    company.paused = [&control] { return !control.running(); };
    company.score = false;
    company.each_block = carry_out(control);
    const RunReport report = run_simulated(run.options, company);
    if (!report.recording_trouble.empty()) {
        throw DeviceError(report.recording_trouble);
    }
    return to_int(ExitCode::fine);
}

int serve_device(const RunCommand& run, hal::TrackerTap<double>& tap, TrackerControl& control) {
    auto options = device_options(run);
    options.tap = &tap;
    options.paused = [&control] { return !control.running(); };
    options.each_step = carry_out(control);
    return linux_board::run_device(options);
}

nlohmann::ordered_json source_of(const RunCommand& run) {
    return is_on_device(run) ? linux_board::describe_source(device_options(run).config) : describe_source(run.options);
}

int run_serve(const ServeCommand& command) {
    if (!command.web.empty() && web::kPage.empty()) {
        throw InputError("serve: this program was built without the live page (TRICOIL_WEB=OFF)");
    }
    TrackerControl control;
    Server server;
    Addresses addresses;
    add_outputs(command, server, control, addresses);
    RecordingSwitch recordings(command.record_folder, source_of(*command.run));
    std::optional<web::WebServer> page;
    if (!command.web.empty()) {
        page.emplace(parse_tcp_address("--web", command.web), server.hub(), control, recordings);
        addresses["web"] = page->url();
    }
    if (addresses.empty()) {
        throw InputError("serve: nothing to serve on; add --fastrak, --openigtlink or --web");
    }
    announce(addresses, command.run->json);
    server.start();
    TapFanOut taps{&server.hub(), &recordings};
    const int result =
        is_on_device(*command.run) ? serve_device(*command.run, taps, control) : serve_simulation(*command.run, taps, control);
    server.stop();
    if (recordings.status().on) {
        recordings.record(false);
    }
    return result;
}

}  // namespace

void add_serve_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<ServeCommand>();
    CLI::App* sub = program.add_subcommand("serve", "Track, and let other programs have the poses");
    sub->add_option("--fastrak", command->fastrak,
                    "Be a Polhemus FASTRAK on pty, pty:LINK, serial:PATH[:BAUD] or tcp:[ADDRESS:]PORT; repeatable")
        ->check(refuse_empty);
    sub->add_flag("--fastrak-continuous", command->fastrak_continuous, "FASTRAK: send from the start, without being asked");
    sub->add_option("--openigtlink", command->openigtlink, "OpenIGTLink server on [ADDRESS:]PORT (18944 is usual)")
        ->check(refuse_empty);
    sub->add_option("--web", command->web,
                    "Live page for browsers on [ADDRESS:]PORT; on this machine alone unless told otherwise. It answers to its "
                    "address, or to a name that is given here as ADDRESS")
        ->check(refuse_empty);
    sub->add_option("--record-folder", command->record_folder, "Where recordings go that are begun on the page")
        ->check(refuse_empty);
    add_run_options(sub, command->run);
    sub->add_flag("--json", command->run->json, "Where clients find us as JSON; with a device also its poses and summary");
    sub->callback([command, &action] { action = [command] { return run_serve(*command); }; });
}

}  // namespace tricoil::host
