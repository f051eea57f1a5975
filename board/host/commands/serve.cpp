// tricoil serve: tracks and sends poses to other programs.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/run_command.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/host/serve/access.hpp"
#include "board/host/serve/button_input.hpp"
#include "board/host/serve/fastrak/fastrak_output.hpp"
#include "board/host/serve/json_lines/json_lines_output.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/server.hpp"
#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/udp_service.hpp"
#include "board/linux/device_config.hpp"
#include "board/linux/text_name.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/stream/stream_loop.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "board/support/service_notice.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"
#ifdef TRICOIL_WITH_OPENIGTLINK
#include "board/host/serve/openigtlink/igtl_session.hpp"
#endif
#ifdef TRICOIL_WITH_OSC
#include "board/pose_text/osc/osc_bundle.hpp"
#endif
#ifdef TRICOIL_WITH_WEB
#include "board/host/serve/web/page_output.hpp"
#include "board/host/serve/websocket/session.hpp"
#endif

namespace tricoil::host {
namespace {

constexpr double kUnlimited_s = 1e9;

struct ServeCommand {
    std::shared_ptr<RunCommand> run = std::make_shared<RunCommand>();
    std::string recording;
    std::vector<const CLI::Option*> of_other_sources;  // what a recording has already
    const CLI::Option* tracker = nullptr;
    std::vector<std::string> fastrak;
    bool fastrak_continuous = false;
    std::string openigtlink;
    std::vector<std::string> igtl_names;
    std::vector<std::string> json_lines;
    std::string websocket;
    std::vector<std::string> origins;
    std::vector<std::string> osc;
    std::string button;
    std::string web;
    std::string record_folder;
    bool open_controls = false;
    bool read_only = false;
    std::vector<std::string> names;
    std::string token_file;
};

using Addresses = nlohmann::ordered_json;

Access access_of(const ServeCommand& command) {
    if (command.open_controls && command.read_only) {
        throw InputError("--open-controls and --read-only exclude each other");
    }
    Access access{Controls::by_token, new_token(), command.names};
    access.controls = command.read_only ? Controls::none : command.open_controls ? Controls::open : Controls::by_token;
    return access;
}

constexpr const char* kReadPoses = "read poses";

const char* can_do(Controls controls) {
    return controls == Controls::open ? "read poses, switch the coils, set the hemisphere and record" : kReadPoses;
}

/// Adds a server for clients without controls. Returns its port.
template <typename Session>
int add_tcp(const char* option, const TcpAddress& address, Server& server, typename TcpService<Session>::Factory factory,
            const StreamLimits& limits = {}) {
    auto service = std::make_unique<TcpService<Session>>(option, address, std::move(factory), limits);
    warn_of_exposure(option, address, kReadPoses);  // its clients have no controls
    const int port = service->port();
    server.add(std::move(service));
    return port;
}

#ifdef TRICOIL_WITH_OPENIGTLINK
void add_openigtlink(const ServeCommand& command, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--openigtlink";
    const igtl_output::DeviceNames names(command.igtl_names, "--igtl-name");
    if (command.openigtlink.empty()) {
        if (!command.igtl_names.empty()) {
            throw InputError("--igtl-name: only with --openigtlink");
        }
        return;
    }
    const TcpAddress address = parse_tcp_address(kOption, command.openigtlink);
    const int port = add_tcp<igtl_output::Session>(kOption, address, server, [&server, names](Stream& stream) {
        auto session = std::make_unique<igtl_output::Session>(stream, names);
        session->set_newest(server.hub().newest());
        return session;
    });
    addresses["openigtlink"] = address.text(port);
}
#else
void add_openigtlink(const ServeCommand&, Server&, Addresses&) {}
#endif

#ifdef TRICOIL_WITH_WEB
void add_websocket(const ServeCommand& command, const PoseUnits& units, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--websocket";
    for (const std::string& origin : command.origins) {
        websocket::check_origin(origin);
    }
    if (command.websocket.empty()) {
        if (!command.origins.empty()) {
            throw InputError("--allow-origin: only with --websocket");
        }
        return;
    }
    const TcpAddress address = parse_tcp_address(kOption, command.websocket);
    const int port = add_tcp<websocket::Session>(
        kOption, address, server,
        [&command, units](Stream& stream) { return std::make_unique<websocket::Session>(stream, command.origins, units); },
        websocket::kLimits);
    addresses["websocket"] = fmt::format("ws://{}/", address.shown().text(port));
}
#else
void add_websocket(const ServeCommand&, const PoseUnits&, Server&, Addresses&) {}
#endif

/// Prints a warning that poses leave this machine.
void warn_of_sending(const char* option, const TcpAddress& address, const std::string& where) {
    if (!address.is_loopback()) {
        print_notice("tricoil: {} {}: poses are sent over the network without encryption\n", option, where);
    }
}

#ifdef TRICOIL_WITH_OSC
void add_osc(const ServeCommand& command, Server& server, Addresses& addresses) {
    constexpr const char* kOption = "--osc";
    for (const std::string& where : command.osc) {
        const TcpAddress address = parse_tcp_address(kOption, where);
        const std::string text = address.text(std::stoi(address.port));
        server.add(std::make_unique<UdpService>(fmt::format("{} {}", kOption, text), address, osc_bundle));
        warn_of_sending(kOption, address, where);
        addresses["osc"].push_back(text);
    }
}
#else
void add_osc(const ServeCommand&, Server&, Addresses&) {}
#endif

/// Returns the output to standard output; null: none.
json_lines::StdoutSender* add_outputs(const ServeCommand& command, Controls controls, const PoseUnits& units, Server& server,
                                      TrackerControl& control, Addresses& addresses) {
    json_lines::StdoutSender* to_standard_output = nullptr;
    for (const std::string& where : command.fastrak) {
        auto output = fastrak::make_output(where, command.fastrak_continuous, controls, server.hub(), control, server.button());
        if (where.starts_with("tcp:")) {
            warn_of_exposure("--fastrak", parse_tcp_address("--fastrak", where.substr(4)), can_do(controls));
        }
        addresses["fastrak"].push_back(output.address);
        server.add(std::move(output.service));
    }
    for (const std::string& where : command.json_lines) {
        if (where == kStandardOutput) {
            if (to_standard_output != nullptr) {
                throw InputError("--json-lines -: given twice; standard output can have the poses once");
            }
            auto sender = std::make_unique<json_lines::StdoutSender>(units);
            to_standard_output = sender.get();
            server.add(std::move(sender));
            continue;
        }
        auto output = json_lines::make_output(where, units);
        if (where.starts_with("tcp:")) {
            warn_of_exposure("--json-lines", output.address, kReadPoses);
        } else {
            warn_of_sending("--json-lines", output.address, where);
        }
        addresses["json_lines"].push_back(output.text);
        server.add(std::move(output.service));
    }
    add_openigtlink(command, server, addresses);
    add_websocket(command, units, server, addresses);
    add_osc(command, server, addresses);
    return to_standard_output;
}

void add_button(const ServeCommand& command, Server& server) {
    if (command.button.empty()) {
        return;
    }
    if (command.fastrak.empty()) {
        throw InputError("--button: only with --fastrak");
    }
    linux_board::DeviceConfig device =
        is_on_device(*command.run) ? device_options(*command.run).config : linux_board::DeviceConfig{};
    linux_board::take_side(device);
    if (command.button == "-" && linux_board::is_text_source(device.device) &&
        linux_board::parse_text_name(device.device).where == "-") {
        throw InputError("--button - and --device exclude each other: both read standard input");
    }
    server.add(std::make_unique<ButtonInput>(command.button, server.button()));
}

/// Prints the addresses before the first pose. A program that starts this one waits for this line.
void announce(const Addresses& addresses, bool json, bool to_standard_error) {
    std::string text = json ? addresses.dump() + "\n" : "";
    for (const auto& [name, address] : addresses.items()) {
        if (!json) {
            text += fmt::format("serving {} on {}\n", name,
                                address.is_array() ? fmt::format("{}", fmt::join(address.get<std::vector<std::string>>(), ", "))
                                                   : address.get<std::string>());
        }
    }
    to_standard_error ? print_notice(text) : print_text(text);
    std::fflush(stdout);
}

#ifdef TRICOIL_WITH_WEB
/// Writes the link with the token to a file that only the user can read, or prints it with the addresses. It is never logged.
void publish_link(const ServeCommand& command, const std::string& link, Addresses& addresses) {
    if (command.open_controls || command.read_only) {
        return;
    }
    if (!command.token_file.empty()) {
        write_private_file(command.token_file, link + "\n");
    } else if (std::getenv("JOURNAL_STREAM") != nullptr) {
        print_notice("tricoil: the link for controls is not written to the journal; use --token-file FILE\n");
    } else {
        addresses["web_controls"] = link;
    }
}

void add_page(const ServeCommand& command, const Access& access, Server& server, TrackerControl& control,
              RecordingSwitch& recordings, Addresses& addresses) {
    if (command.web.empty()) {
        return;
    }
    const TcpAddress address = parse_tcp_address("--web", command.web);
    auto page = web::make_output(address, access, server.hub(), control, recordings, server.button());
    server.add_apart(std::move(page.service));
    warn_of_exposure("--web", address, can_do(access.controls));
    addresses["web"] = page.url;
    publish_link(command, page.control_url, addresses);
}
#else
void add_page(const ServeCommand&, const Access&, Server&, TrackerControl&, RecordingSwitch&, Addresses&) {}
#endif

/// The loop passes the requests of clients to the source, and notifies the service manager. A request for an unknown sensor, or
/// with a number that is not finite, has no effect.
LoopParams loop_params(PoseHub& hub, TrackerControl& control, ServiceNotice& notice, const std::function<void()>& ready) {
    LoopParams params;
    params.ready = ready;
    params.is_paused = [&] {
        notice.alive();
        return !control.running();
    };
    params.each_step = [&](Source& source) {
        for (const auto& request : control.take()) {
            (void)source.set_hemisphere(request.sensor, request.towards);
        }
    };
    params.each_health = [&hub](const LinkHealth& health) { hub.set_health(health); };
    return params;
}

int serve_simulation(RunCommand& run, const LoopParams& loop, tracking::TrackerTap<double>& tap) {
    run.options.realtime = true;
    run.options.duration_s = run.options.duration_s.value_or(kUnlimited_s);
    RunObservers observers;
    observers.tap = &tap;
    observers.loop = loop;
    observers.score = false;
    const RunReport report = run_simulated(run.options, observers);
    if (!report.recording_error.empty()) {
        throw DeviceError(report.recording_error);
    }
    return to_int(ExitCode::fine);
}

int serve_device(const RunCommand& run, const LoopParams& loop, tracking::TrackerTap<double>& tap) {
    auto options = device_options(run);
    options.tap = &tap;
    options.loop = loop;
    options.loop.realtime = true;  // a file of couplings
    return linux_board::run_device(options);
}

/// Plays the recording at its own pace.
int serve_recording(const Recording& recording, const std::string& tracker, LoopParams loop, tracking::TrackerTap<double>& tap) {
    TrackerStage trackers(tap);
    RecordedSource source(recording, settings_of(recording, tracker), trackers);
    loop.realtime = true;
    StreamLoop(source, loop).run();
    return to_int(ExitCode::fine);
}

nlohmann::ordered_json source_of(const ServeCommand& command) {
    if (!command.recording.empty()) {
        return {{"kind", "recording"}, {"recording", command.recording}};
    }
    const RunCommand& run = *command.run;
    return is_on_device(run) ? linux_board::describe_source(device_options(run).config) : describe_source(run.options);
}

void check_components(const ServeCommand& command) {
    const auto check = [](Component component, const char* option, bool is_given) {
        if (is_given) {
            require(component, option);
        }
    };
    check(Component::openigtlink, "--openigtlink", !command.openigtlink.empty() || !command.igtl_names.empty());
    check(Component::osc, "--osc", !command.osc.empty());
    check(Component::web, "--websocket", !command.websocket.empty() || !command.origins.empty());
    check(Component::web, "--web", !command.web.empty());
}

/// A recording has its own sensor, trackers and calibration.
std::optional<Recording> open_recording(const ServeCommand& command) {
    if (command.recording.empty()) {
        return std::nullopt;
    }
    for (const CLI::Option* option : command.of_other_sources) {
        if (option->count() > 0) {
            throw InputError(
                fmt::format("{}: not with a recording, which has its own; leave one of them out", option->get_name()));
        }
    }
    return std::optional<Recording>(command.recording);
}

int run_source(const ServeCommand& command, const std::optional<Recording>& recording, const LoopParams& loop,
               tracking::TrackerTap<double>& taps) {
    if (recording) {
        const std::string tracker = command.tracker->count() > 0 ? command.run->options.tracker : "";
        return serve_recording(*recording, tracker, loop, taps);
    }
    return is_on_device(*command.run) ? serve_device(*command.run, loop, taps) : serve_simulation(*command.run, loop, taps);
}

/// Options of poses that no output of the command has.
void refuse_unused(const ServeCommand& command) {
    const OutputOptions& options = command.run->options.output;
    const bool has_text =
        !command.json_lines.empty() || !command.websocket.empty() || (command.run->json && is_on_device(*command.run));
    if (!has_text && (options.unit != OutputOptions{}.unit || !options.euler.empty())) {
        throw InputError(fmt::format("{}: no output with units and angles of its own; add --json-lines or --websocket",
                                     options.euler.empty() ? "--units" : "--euler"));
    }
    if (!command.web.empty() && !options.align_points.empty()) {
        throw InputError("--align: not with --web, whose picture has the source as its origin; use --json-lines or --websocket");
    }
}

/// Why clients cannot set the hemisphere by the position that they see; empty: they can.
std::string hemisphere_refusal(const ServeCommand& command) {
    return !command.recording.empty()                     ? "the hemisphere is part of the recording"
           : command.run->options.output.relative_to != 0 ? "relative poses do not show the hemisphere: use --hemisphere"
                                                          : "";
}

int run_serve(const ServeCommand& command) {
    check_components(command);
    refuse_unused(command);
    refuse_fixed_method(command.run->options.tracker);
    TrackerControl control(hemisphere_refusal(command));
    const auto recording = open_recording(command);
    if (recording || is_on_device(*command.run)) {
        check_reference(command.run->options.output, recording ? recording->sensors() : tracking::kMaxSensors);
    } else {
        complete_simulation_options(*command.run);
    }
    RecordingSwitch recordings(command.record_folder, source_of(command));
    Server server;
    PoseStages stages(command.run->options.output, server.hub());
    Addresses addresses;
    const Access access = access_of(command);
    json_lines::StdoutSender* const to_standard_output =
        add_outputs(command, access.controls, stages.units(), server, control, addresses);
    add_button(command, server);
    add_page(command, access, server, control, recordings, addresses);
    if (addresses.empty() && to_standard_output == nullptr) {
        throw InputError("serve: no output; add --fastrak, --openigtlink, --json-lines, --websocket, --osc or --web");
    }
    if (to_standard_output != nullptr && command.run->json) {
        throw InputError("--json-lines - and --json exclude each other: both write to standard output");
    }
    ServiceNotice notice;
    const auto ready = [&] {
        announce(addresses, command.run->json, to_standard_output != nullptr);
        server.start();
        notice.ready();
    };
    TapFanOut taps{&stages, &recordings};
    std::optional<CapturedText> summary;  // of a device; not between the poses
    if (to_standard_output != nullptr) {
        summary.emplace();
    }
    const int result = run_source(command, recording, loop_params(server.hub(), control, notice, ready), taps);
    stages.finish();
    server.stop();
    if (summary) {
        print_notice(summary->text());
    }
    if (recordings.status().on) {
        recordings.record(false);
    }
    if (to_standard_output != nullptr) {
        to_standard_output->finish();
    }
    return result;
}

}  // namespace

void add_serve_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<ServeCommand>();
    folder_name(sub->add_option("recording", command->recording,
                                "Play this recording of run --record instead of a device or a simulation"));
    const auto add = [&](const char* name, auto& value, const char* what) {
        return sub->add_option(name, value, what)->check(refuse_empty);
    };
    sub->option_defaults()->group("Outputs");
    add("--fastrak", command->fastrak,
        "Emulate a Polhemus FASTRAK on pty, pty:LINK, serial:PATH[:BAUD] or tcp:[ADDRESS:]PORT; repeatable");
    sub->add_flag("--fastrak-continuous", command->fastrak_continuous, "FASTRAK: start in continuous mode");
    add("--button", command->button,
        "FASTRAK: button of the stylus from text lines of standard input (-), or of a serial port or named pipe: an empty "
        "line (Enter) is a click, 1 presses, 0 releases");
    add("--openigtlink", command->openigtlink, "OpenIGTLink server on [ADDRESS:]PORT (18944 is usual)");
    sub->add_option(
        "--igtl-name", command->igtl_names,
        "OpenIGTLink: name of a sensor, for example SensorToTracker, instead of tricoil_1; repeatable, in the order of "
        "the sensors");
    add("--json-lines", command->json_lines,
        "Each pose as a line of JSON: to clients of tcp:[ADDRESS:]PORT, as a datagram to udp:[HOST:]PORT, or to "
        "standard output (-); repeatable");
    add("--websocket", command->websocket, "Each pose as a JSON message to WebSocket clients of [ADDRESS:]PORT");
    add("--allow-origin", command->origins,
        "WebSocket: pages of this origin may connect, for example http://localhost:3000; repeatable. Programs "
        "other than browsers need no permission");
    add("--osc", command->osc,
        "Each pose as an Open Sound Control bundle by UDP to [HOST:]PORT; repeatable. Messages: "
        "/tricoil/N/position (x y z, m), /tricoil/N/quaternion (w x y z), /tricoil/N/valid (1 or 0); N from 1");
    add("--web", command->web,
        "Live page for browsers on [ADDRESS:]PORT; without ADDRESS, only for browsers of this machine. "
        "Browsers can use a host name that is given as ADDRESS or with --allow-host");
    folder_name(sub->add_option("--record-folder", command->record_folder,
                                "Folder for recordings that are started and played on the live page"));
    sub->option_defaults()->group("Access");
    sub->add_flag("--open-controls", command->open_controls,
                  "Everyone may use the controls: coils, hemisphere, recordings, saved settings of FASTRAK clients");
    sub->add_flag("--read-only", command->read_only, "No controls");
    file_name(sub->add_option("--token-file", command->token_file,
                              "Write the link for controls to this file, readable by this user only"));
    add("--allow-host", command->names, "Host name under which browsers may use the server; repeatable");
    const std::vector<const CLI::Option*> own = options_of(*sub);
    add_run_options(sub, command->run);
    command->tracker = sub->get_option("--tracker");
    for (const CLI::Option* option : options_of(*sub)) {
        const auto is_in = [&](const auto& list) { return std::find(list.begin(), list.end(), option) != list.end(); };
        if (!is_in(own) && !is_in(command->run->stages) && option != command->tracker) {
            command->of_other_sources.push_back(option);
        }
    }
    sub->add_flag("--json", command->run->json, "Addresses of the outputs as JSON; with a device also poses and summary");
    set_examples(sub, {{"the live page of a simulated hand; prints the link for controls", "tricoil serve --web 8080"},
                       {"OpenIGTLink, from a front end or a tracker board on CAN FD",
                        "tricoil serve --openigtlink 18944 --device can:can0"},
                       {"each pose as a line of JSON", "tricoil serve --json-lines tcp:5005"},
                       {"a recording, at its own pace", "tricoil serve take1 --json-lines -"},
                       {"emulates a Polhemus FASTRAK with two stations; the Enter key is the button of the stylus",
                        "tricoil serve --fastrak pty:fastrak --stations 2 --button -"}});
    sub->callback([command, &action] { action = [command] { return run_serve(*command); }; });
}

}  // namespace tricoil::host
