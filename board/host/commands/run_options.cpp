// Options of `run`, and those that `serve` shares with it.
#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/host/commands/run_command.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/support/tracker_choice.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kSecondsType = "SECONDS";

// Titles of groups.
constexpr const char* kSimulation = "Simulated sensor";
constexpr const char* kFaults = "Simulated noise and faults";
constexpr const char* kDevice = "Device";
constexpr const char* kTracking = "Tracking";
constexpr const char* kOutput = "Output";

std::vector<std::string> all_trackers() {
    auto names = kTrackerNames;
    names.insert(names.end(), kFixedTrackerNames.begin(), kFixedTrackerNames.end());
    return names;
}

void add_simulation_options(CLI::App* sub, RunCommand& command) {
    sub->option_defaults()->group(kSimulation);
    RunOptions& o = command.options;
    sub->add_option("--scenario", o.scenario, "Built-in scenario (see tricoil run --list) or a .toml file")
        ->type_name(kScenarioType)
        ->capture_default_str();
    sub->add_option("--trajectory", o.trajectory, "Recorded path: 4x4 matrices at 100 Hz")->type_name(kFileType);
    vector_xyz(sub->add_option("--place", command.place, "Centre of the recorded path, m"))->default_str("0.9,0,0");
    sub->add_option("--speed", o.speed, "Play the motion faster (2) or slower (0.5)")->capture_default_str();
    sub->add_option("--stations", o.stations,
                    "Number of simulated sensors, 1-4; sensors 2 to 4 are near the first and move little")
        ->capture_default_str();
    sub->add_option("--sample-rate-hz", o.sample_rate_hz, "Samples per second of each converter")->capture_default_str();
    sub->add_option("--seed", o.seed, "Seed of noise and motion")->check(refuse_overflow)->capture_default_str();
}

void add_fault_options(CLI::App* sub, RunOptions& o) {
    sub->option_defaults()->group(kFaults);
    sub->add_option("--fault", o.faults,
                    "Simulate a fault: NAME[:ARG,...][@BEGIN[-END]], for example open_coil:S2@1-1.5; repeatable")
        ->type_name(kFaultType);
    sub->add_flag("--no-noise", o.no_noise, "No converter noise and no mains hum; quantisation remains");
}

void add_device_options(CLI::App* sub, RunCommand& command) {
    sub->option_defaults()->group(kDevice);
    command.device_option =
        sub->add_option(
               "--device", command.device,
               "sim:, can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL] or serial:PATH; text of other hardware: columns:WHERE, "
               "couplings:WHERE or poses:WHERE (-, tcp:PORT, udp:PORT or a file)")
            ->type_name(kDeviceType)
            ->capture_default_str();
    file_name(sub->add_option("--config", command.config, "Board configuration (TOML); --device overrides it"));
    wiring_file(sub, command.wiring);
    seconds(sub->add_option("--wait", command.wait_s,
                            "Time to wait for the device at the start, not for standard input; 0: no limit"),
            true)
        ->capture_default_str();
    seconds(sub->add_option("--give-up-after", command.give_up_after_s,
                            "End with exit code 3 if the device has not worked for this time; 0: never"),
            true)
        ->capture_default_str();
}

void add_tracking_options(CLI::App* sub, RunCommand& command) {
    sub->option_defaults()->group(kTracking);
    RunOptions& o = command.options;
    one_of(sub->add_option("--mux", o.multiplexing,
                           "Coils in turn (tdm), all at once (fdm), or all at once with a low carrier each (dual-band)"),
           kMultiplexingNames)
        ->capture_default_str();
    one_of(sub->add_option("--tracker", o.tracker,
                           "direct: closed form; previous: previous-measurement technique; scaat: filter; dual-band: removes the "
                           "error of metal, needs --mux dual-band; "
                           "fixed-direct, fixed-previous: in integers, only in a simulated tricoil run"),
           all_trackers())
        ->capture_default_str();
    sub->add_option("--passes", o.passes, "Passes of the previous-measurement step per frame, 1-10")->capture_default_str();
    sub->add_option("--rate-hz", o.frame_rate_hz, "Frames per second")->capture_default_str();
    command.duration = sub->add_option("--duration", command.duration_s,
                                       "Simulated or device time; default: the scenario's in a simulated tricoil run, otherwise "
                                       "until a signal")
                           ->type_name(kSecondsType);
    vector_xyz(sub->add_option(
        "--hemisphere", o.hemisphere,
        "Direction to the half space of the sensor at the start; 0,0,0: unknown; default: from the motion. A simulated run "
        "with this option is also confined"));
    sub->add_flag("--confined", o.confined,
                  "The sensor never leaves the half space of the start (device: of --hemisphere); the hemisphere stays known "
                  "after a loss");
    file_name(sub->add_option(
        "--calibration", o.calibration,
        "Coils and surroundings for the tracker: file of tricoil calibrate; default: that of --config, or ideal coils"));
    sub->add_flag("--no-deskew", o.no_deskew, "TDM, direct and previous: treat the latest three columns as simultaneous");
    sub->add_option("--predict", o.predict_ahead_s,
                    "scaat, dual-band: deliver poses this time ahead of the newest column, 0 (no prediction) to 0.1")
        ->type_name(kSecondsType);
}

void add_output_options(CLI::App* sub, RunCommand& command) {
    sub->option_defaults()->group(kOutput);
    RunOptions& o = command.options;
    file_name(sub->add_option("--out", o.out_csv,
                              "Write all poses to this CSV file, in a simulated run with the true poses; - is standard output"));
    sub->add_option("--json-lines", command.json_lines,
                    "Write all poses as lines of JSON to standard output (-), as tricoil serve --json-lines does")
        ->check(refuse_empty);
    file_name(sub->add_option(
        "--couplings", o.couplings,
        "Simulated run: write true poses and couplings to this CSV file, for tricoil calibrate and evaluate; one line "
        "per pose, averaged while the sensor rests"));
    file_name(sub->add_option("--record-wav", o.wav,
                              "Simulated run, coils all at once: write the samples of the converters (sensor coils 1 to 3, "
                              "reference) to this WAV file, for tricoil demodulate; - is standard output"));
    file_name(sub->add_option("--samples", o.samples, "Integer trackers: write the input of the tracker to this file"));
    sub->add_flag("--smooth", o.smooth, "Also give the errors of the smoothed motion, for comparison (see tricoil smooth)");
    sub->add_flag("--json", command.json, "Summary as JSON");
}

void set_run_examples(CLI::App* sub) {
    set_examples(sub, {{"a simulated hand", "tricoil run"},
                       {"coils in turn, with the filter", "tricoil run --scenario circle --mux tdm --tracker scaat"},
                       {"metal from 2 s to 6 s; poses and true poses as CSV",
                        "tricoil run --fault metal:0.6,0.3,0,0.08@2-6 --out poses.csv"},
                       {"a recording, for tricoil replay, convert and plot", "tricoil run --tracker scaat --record take1"},
                       {"a front end or a tracker board on CAN FD", "tricoil run --device can:can0 --out poses.csv"},
                       {"couplings of other hardware, with their noise",
                        "tricoil run --device couplings:frames.csv,rate_hz=100,sigma=1e-6 --json"}});
}

}  // namespace

void add_run_options(CLI::App* sub, const std::shared_ptr<RunCommand>& command) {
    RunOptions& o = command->options;
    command->app = sub;
    add_simulation_options(sub, *command);
    add_fault_options(sub, o);
    add_device_options(sub, *command);
    add_tracking_options(sub, *command);
    command->stages = add_stage_options(sub, o.output);
    sub->option_defaults()->group(kOutput);
    folder_name(sub->add_option("--record", o.record, "Record the run into this new folder, for tricoil replay and convert"));
}

void add_run_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<RunCommand>();
    RunOptions& o = command->options;
    add_run_options(sub, command);
    command->shared_options = options_of(*sub);
    sub->option_defaults()->group(kSimulation);
    sub->add_flag("--list", command->list, "List the built-in scenarios");
    one_of(sub->add_option("--fidelity", o.fidelity,
                           "Simulate every ADC sample (samples), or compute columns with the noise of the demodulator (columns)"),
           {"samples", "columns"})
        ->capture_default_str();
    sub->add_flag("--realtime", o.realtime, "Run in real time");
    add_output_options(sub, *command);
    set_run_examples(sub);
    sub->callback([command, &action] { action = [command] { return run_tracking(*command); }; });
}

}  // namespace tricoil::host
