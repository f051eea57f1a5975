// tricoil serve: tracks and sends poses to other programs.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/serve_command.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/service_notice.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"

namespace tricoil::host {
namespace {

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

/// Options of poses that no output of the command has.
void refuse_unused(const ServeCommand& command) {
    const OutputOptions& options = command.run->options.output;
    const bool has_text =
        !command.json_lines.empty() || !command.websocket.empty() || (command.run->json && is_on_device(*command.run));
    if (!has_text && (options.unit != OutputOptions{}.unit || !options.euler.empty())) {
        throw InputError(fmt::format("{}: no output with units and angles of its own; add --json-lines or --websocket",
                                     options.euler.empty() ? "--units" : "--euler"));
    }
    refuse_if(!command.web.empty() && !options.align_points.empty(),
              "--align: not with --web, whose picture has the source as its origin; use --json-lines or --websocket");
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
    const ServeOutputs outputs = open_outputs(command, stages.units(), server, control, recordings);
    ServiceNotice notice;
    const auto ready = [&] {
        announce(outputs, command.run->json);
        server.start();
        notice.ready();
    };
    TapFanOut taps{&stages, &recordings};
    std::optional<CapturedText> summary;  // of a device; not between the poses
    if (outputs.to_standard_output != nullptr) {
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
    if (outputs.to_standard_output != nullptr) {
        outputs.to_standard_output->finish();
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
