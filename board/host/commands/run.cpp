// tricoil run: tracks a simulated sensor or a real device.
#include <fmt/format.h>

#include <memory>

#include "board/host/commands/commands.hpp"
#include "board/host/commands/run_command.hpp"
#include "board/host/run/report.hpp"
#include "board/linux/device_run.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"

namespace tricoil::host {
namespace {

int list_scenarios(bool json) {
    Json list = Json::array();
    std::string text;
    for (const auto& scenario : builtin_scenarios()) {
        list.push_back({{"name", scenario.name}, {"description", scenario.description}});
        text += fill(list.back(), "{name:<10}  {description}\n");
    }
    print_text(json ? list.dump(2) + "\n" : text);
    return to_int(ExitCode::fine);
}

void check_vector(const std::vector<double>& v, const char* option) {
    if (!std::isfinite(v[0] + v[1] + v[2])) {
        throw InputError(std::string(option) + ": must be three finite numbers");
    }
}

}  // namespace

linux_board::DeviceRunOptions device_options(const RunCommand& command) {
    const bool duration_given = command.duration->count() > 0;
    linux_board::DeviceRunOptions options;
    if (!command.config.empty()) {
        options.config = linux_board::load_device_config(command.config);
    }
    if (command.device_option->count() > 0) {
        options.config.device = command.device;
    }
    if (options.config.device.empty()) {
        throw InputError(command.config + ": 'device' is missing; set it there or give --device");
    }
    refuse_fixed_method(command.options.tracker);
    if (!command.options.samples.empty()) {
        throw InputError("--samples: not with a device, because a device sends columns");
    }
    if (command.options.bands != 1) {
        throw InputError("--bands: not with a device, which sends the columns of one band");
    }
    if (command.options.stations != 1) {
        throw InputError("--stations: not with a device, which has its own number of sensors");
    }
    if (command.options.tracker != "direct" || command.config.empty()) {
        options.config.method = command.options.tracker;
    }
    if (prediction_of_option(options.config.method, command.options.predict_ahead_s).count() > 0) {
        options.config.method = fmt::format("scaat,predict_s={}", command.options.predict_ahead_s);
    }
    if (!command.options.hemisphere.empty()) {
        const auto& h = command.options.hemisphere;
        check_vector(h, "--hemisphere");
        options.config.hemisphere = Vec3<double>(h[0], h[1], h[2]);
    }
    options.config.confined = options.config.confined || command.options.confined;
    if (!command.options.out_csv.empty()) {
        options.config.csv = command.options.out_csv;
    }
    if (duration_given && !(std::isfinite(command.duration_s) && command.duration_s > 0)) {
        throw InputError("--duration must be a positive number of seconds");
    }
    if (!options.config.calibration.empty()) {
        options.calibration = read_calibration(options.config.calibration).calibration;
    }
    options.reference = reference_sensor(command);
    options.record = command.options.record;
    options.tips = ToolTips(command.options.output.tips);
    options.duration_s = duration_given ? command.duration_s : 0;
    options.wait_s = command.wait_s;
    options.give_up_after_s = command.give_up_after_s;
    options.json = command.json;
    return options;
}

namespace {

int run(RunCommand& command) {
    if (command.list) {
        return list_scenarios(command.json);
    }
    const OutputOptions& output = command.options.output;
    if (is_on_device(command)) {
        if (!output.align_points.empty() || output.boresight || output.unit != OutputOptions{}.unit || !output.euler.empty()) {
            throw InputError("--align, --boresight, --units and --euler: only for a simulated run");
        }
        const auto options = device_options(command);
        if (!output.tips.empty() && options.config.csv.empty() && !options.json && !options.config.publish) {
            throw InputError("--tip: no output for its poses; add --out FILE or --json");
        }
        if (output.relative_to != 0 && options.config.csv.empty() && !options.json) {
            throw InputError("--relative-to: no output for its poses; add --out FILE or --json");
        }
        return linux_board::run_device(options);
    }
    complete_simulation_options(command);
    if (command.options.out_csv.empty() && (output.relative_to != 0 || !output.tips.empty() || !output.align_points.empty() ||
                                            output.boresight || output.unit != OutputOptions{}.unit || !output.euler.empty())) {
        throw InputError("--tip, --align, --boresight, --units, --euler and --relative-to change the CSV only; add --out FILE");
    }
    command.options.show_live = !command.json;
    const RunReport report = run_simulated(command.options);
    print_result(run_result(report), command.json, run_text);
    if (!report.recording_error.empty()) {
        throw DeviceError(report.recording_error);
    }
    if (report.score.scored == 0 && report.score.invalid > 0) {
        const bool side_unknown = report.seen_flags.has(tracking::PoseFlag::hemisphere_unknown);
        print_notice("tricoil: no valid pose: {}{}\n", to_text(report.seen_flags),
                     side_unknown ? "; give the half space of the sensor with --hemisphere X,Y,Z, or use --confined" : "");
        return to_int(ExitCode::check_failed);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

std::optional<std::uint8_t> reference_sensor(const RunCommand& command) {
    const int number = command.options.output.relative_to;
    const int most = is_on_device(command) ? tracking::kMaxSensors : command.options.stations;
    if (number == 0) {
        return std::nullopt;
    }
    if (number < 0 || number > most) {
        throw InputError(fmt::format("--relative-to {}: must be the number of a sensor, 1 to {}{}", number, most,
                                     is_on_device(command) ? "" : "; --stations sets how many there are"));
    }
    return static_cast<std::uint8_t>(number - 1);
}

bool is_on_device(const RunCommand& command) { return command.device != "sim:" || !command.config.empty(); }

void complete_simulation_options(RunCommand& command) {
    check_vector(command.place, "--place");
    if (!command.options.hemisphere.empty()) {
        check_vector(command.options.hemisphere, "--hemisphere");
    }
    (void)reference_sensor(command);
    command.options.place_m = Vec3<double>(command.place[0], command.place[1], command.place[2]);
    if (command.duration->count() > 0) {
        command.options.duration_s = command.duration_s;
    }
}

void add_run_options(CLI::App* sub, const std::shared_ptr<RunCommand>& command) {
    RunOptions& o = command->options;
    sub->add_option("--scenario", o.scenario, "Built-in scenario (see tricoil run --list) or a .toml file")
        ->capture_default_str();
    sub->add_option("--trajectory", o.trajectory, "Recorded path: 4x4 matrices at 100 Hz");
    sub->add_option("--place", command->place, "Centre of the recorded path: x,y,z in metres")
        ->delimiter(',')
        ->expected(3)
        ->capture_default_str();
    sub->add_option("--speed", o.speed, "Play the recorded path faster (2) or slower (0.5)")->capture_default_str();
    command->device_option = sub->add_option("--device", command->device,
                                             "Device: sim:, can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL], serial:PATH")
                                 ->capture_default_str();
    sub->add_option("--config", command->config, "Board configuration (TOML); --device overrides it")->check(refuse_empty);
    sub->add_option("--give-up-after", command->give_up_after_s,
                    "End with exit code 3 if the device has not worked for this time, s; 0: never")
        ->check(refuse_negative_time)
        ->capture_default_str();
    sub->add_option("--wait", command->wait_s, "Time to wait for the device at the start, s; 0: no limit")
        ->check(refuse_negative_time)
        ->capture_default_str();
    sub->add_option("--mux", o.multiplexing, "tdm (coils in turn) or fdm (all at once)")->capture_default_str();
    sub->add_option(
           "--bands", o.bands,
           "1, or 2: FDM with a second set of low tones (480, 720 and 960 Hz at 240 frames/s) that corrects the effect of "
           "metal")
        ->capture_default_str();
    sub->add_option(
           "--tracker", o.tracker,
           "direct, previous, previous-angles or scaat (filter); in integers, only in a simulated tricoil run: fixed-direct, "
           "fixed-previous")
        ->capture_default_str();
    sub->add_option("--passes", o.passes, "Passes of the previous-measurement step per frame, 1-10")->capture_default_str();
    sub->add_option("--rate-hz", o.frame_rate_hz, "Frames per second")->capture_default_str();
    command->duration = sub->add_option(
        "--duration", command->duration_s,
        "Duration, s of simulated or device time; default: the scenario's in a simulated tricoil run, otherwise until a signal");
    sub->add_option("--fault", o.faults,
                    "Simulate a fault: NAME[:ARG,...][@BEGIN[-END]], for example open_coil:S2@1-1.5; repeatable");
    sub->add_option(
           "--hemisphere", o.hemisphere,
           "Direction to the half space of the sensor at the start, x,y,z; 0,0,0: unknown; default: from the motion. A simulated "
           "run with this option is also confined")
        ->delimiter(',')
        ->expected(3);
    sub->add_flag("--confined", o.confined,
                  "The sensor never leaves the half space of the start (device: of --hemisphere); the hemisphere stays known "
                  "after a loss");
    sub->add_flag("--no-deskew", o.no_deskew, "TDM, direct and previous: treat the latest three columns as simultaneous");
    sub->add_option("--predict", o.predict_ahead_s,
                    "scaat: deliver poses this many seconds (at most 0.1) ahead of the newest column");
    sub->add_flag("--no-noise", o.no_noise, "No converter noise and no mains; with quantisation");
    sub->add_option("--seed", o.seed, "Seed of noise and motion")->check(refuse_overflow)->capture_default_str();
    sub->add_option("--stations", o.stations, "Simulated sensors, 1-4; the further ones are near the first and move little")
        ->capture_default_str();
    sub->add_option("--tip", o.output.tips,
                    "Poses of a tool's tip: a file of calibrate --pivot, or [SENSOR:]X,Y,Z (m, sensor frame); repeatable. "
                    "Recordings keep the poses of the sensor")
        ->check(refuse_empty);
    sub->add_option(
        "--relative-to", o.output.relative_to,
        "Output all poses relative to this sensor (1 is the first), with their covariance; recordings stay in the source "
        "frame");
    sub->add_option("--record", o.record, "Record the run into this new folder, for tricoil replay and convert")
        ->check(refuse_empty);
}

void add_run_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<RunCommand>();
    RunOptions& o = command->options;
    CLI::App* sub =
        program.add_subcommand("run", "Track a simulated sensor (poses are compared with the truth) or a real device");
    sub->add_flag("--list", command->list, "List the built-in scenarios");
    add_run_options(sub, command);
    sub->add_option("--samples", o.samples, "Integer trackers: write the input of the tracker to this file")->check(refuse_empty);
    sub->add_option(
           "--fidelity", o.fidelity,
           "samples: simulate every ADC sample; columns: compute columns with the noise of the demodulator, without samples")
        ->capture_default_str();
    sub->add_flag("--smooth", o.smooth, "Also give the errors of the smoothed motion, for comparison (see tricoil smooth)");
    sub->add_flag("--realtime", o.realtime, "Run in real time");
    sub->add_option("--out", o.out_csv,
                    "Write all poses to this CSV file, in a simulated run with the true poses; - is standard output")
        ->check(refuse_empty);
    sub->add_option("--align", o.output.align_points,
                    "CSV: alignment frame from three points (m): origin, point on the x axis, point towards the y axis")
        ->delimiter(',')
        ->expected(9);
    sub->add_flag("--boresight", o.output.boresight, "CSV: the attitude of the first valid pose becomes zero");
    sub->add_option("--units", o.output.unit, "CSV: unit of positions: m, mm, cm or in")->capture_default_str();
    sub->add_option("--euler", o.output.euler, "CSV: add Euler angles (intrinsic) in this order of axes, for example zyx")
        ->check(refuse_empty);
    sub->add_flag("--json", command->json, "Summary as JSON");
    sub->callback([command, &action] { action = [command] { return run(*command); }; });
}

}  // namespace tricoil::host
