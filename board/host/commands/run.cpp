// tricoil run: tracks a simulated sensor or a real device.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/run_command.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/host/run/report.hpp"
#include "board/linux/device_run.hpp"
#include "board/linux/text_name.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/components.hpp"
#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/tracking/hemisphere.hpp"

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
    refuse_if(!tracking::is_hemisphere(Vec3<double>(v.data())), "{}: must be three finite numbers, none of them huge", option);
}

}  // namespace

linux_board::DeviceRunOptions device_options(const RunCommand& command) {
    const bool duration_given = command.duration->count() > 0;
    linux_board::DeviceRunOptions options;
    if (!command.config.empty()) {
        options.config = linux_board::load_device_config(command.config);
    }
    if (command.device_option->count() > 0) {
        linux_board::set_device(options.config, command.device);
    }
    options.config.wiring = command.wiring.empty() ? options.config.wiring : command.wiring;
    refuse_if(options.config.device.empty(), "{}: 'device' is missing; set it there or give --device", command.config);
    refuse_fixed_method(command.options.tracker);
    refuse_if(!command.options.samples.empty(), "--samples: not with a device, because a device sends columns");
    refuse_if(!command.options.wav.empty(), "--record-wav: not with a device; use tricoil device capture");
    refuse_if(!command.options.record.empty() && linux_board::has_poses(options.config.device),
              "--record: poses have no columns; use --out");
    refuse_if(!command.options.couplings.empty(), "--couplings: not with a device, whose true poses are not known");
    for (const CLI::Option* option : options_of(*command.app)) {
        refuse_if(option->count() > 0 && option->get_group().starts_with("Simulated"),
                  "{}: only with a simulated sensor; leave it out, or use --device sim:", option->get_name());
    }
    if (command.options.tracker != "direct" || command.config.empty()) {
        options.config.method = command.options.tracker;
    }
    if (prediction_of_option(options.config.method, command.options.predict_ahead_s).count() > 0) {
        options.config.method =
            fmt::format("{},predict_s={}", name_of_choice(options.config.method), command.options.predict_ahead_s);
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
    refuse_if(duration_given && !(std::isfinite(command.duration_s) && command.duration_s > 0),
              "--duration must be a positive number of seconds");
    if (!command.options.calibration.empty()) {
        options.config.calibration = command.options.calibration;
    }
    if (!options.config.calibration.empty()) {
        options.calibration = read_coils(options.config.calibration);
    }
    const std::string& device = options.config.device;
    const std::string from = linux_board::is_text_source(device) ? linux_board::parse_text_name(device).where : "";
    check_outputs({{"--out", options.config.csv}}, {from == kStandardOutput ? "/dev/stdin" : from, command.config,
                                                    options.config.calibration, options.config.wiring});
    check_reference(command.options.output, tracking::kMaxSensors);
    options.record = command.options.record;
    options.output = command.options.output;
    options.json_lines = !command.json_lines.empty();
    options.duration_s = duration_given ? command.duration_s : 0;
    options.wait_s = from == kStandardOutput ? 0 : command.wait_s;  // the end of a pipe ends the run
    options.give_up_after_s = command.give_up_after_s;
    options.json = command.json;
    return options;
}

namespace {

void check_json_lines(const RunCommand& command) {
    if (command.json_lines.empty()) {
        return;
    }
    refuse_if(command.json_lines != kStandardOutput,
              "--json-lines {}: must be - (standard output); tricoil serve has tcp: and udp:", command.json_lines);
    refuse_if(command.options.out_csv == kStandardOutput,
              "--json-lines - and --out - exclude each other: both write to standard output");
}

int run_on_device(const RunCommand& command) {
    const auto options = device_options(command);
    refuse_without_output(command.stages, !options.config.csv.empty() || options.json || options.json_lines,
                          "add --out FILE, --json-lines - or --json", options.config.publish);
    return linux_board::run_device(options);
}

/// A negative number needs no quotes, and shell_word() would make it a path.
std::string value_word(const std::string& value) { return value.starts_with('-') ? value : shell_word(value); }

std::string option_words(const CLI::Option& option) {
    if (is_flag(option)) {
        return " " + shown_name(option);
    }
    if (option.get_delimiter() == ',') {  // the words of one value
        return fmt::format(" {} {}", shown_name(option), value_word(fmt::format("{}", fmt::join(option.results(), ","))));
    }
    std::string words;
    for (const std::string& value : option.results()) {
        words += fmt::format(" {} {}", shown_name(option), value_word(value));
    }
    return words;
}

/// The command that shows a simulated run on the live page, to be pasted: "PROGRAM serve --web 8080" with those options of the
/// run that `serve` has too, except its duration and recording.
std::string see_it_command(const CLI::App& run, const std::vector<const CLI::Option*>& shared) {
    std::string words = shell_word(run.get_parent()->get_name()) + " serve --web 8080";
    for (const CLI::Option* option : shared) {
        constexpr std::array<std::string_view, 5> kNotOfThePage{"--duration", "--record", "--units", "--euler", "--align"};
        const bool is_of_page = std::ranges::find(kNotOfThePage, shown_name(*option)) == kNotOfThePage.end();
        words += option->count() > 0 && is_of_page ? option_words(*option) : "";
    }
    return words;
}

/// The command that demodulates the samples of --record-wav, to be pasted.
std::string demodulate_command(const CLI::App& run, const std::string& wav, const signal::AcquisitionPlan& plan) {
    const auto carriers = std::span(plan.params.carrier_hz).first(static_cast<std::size_t>(plan.carriers()));
    return fmt::format("{} demodulate {} --carrier-hz {} --block {} --reference 4 --induced --out couplings.csv",
                       shell_word(run.get_parent()->get_name()), value_word(wav), fmt::join(carriers, ","), plan.block_samples);
}

}  // namespace

int run_tracking(RunCommand& command) {
    if (command.list) {
        return list_scenarios(command.json);
    }
    check_json_lines(command);
    if (is_on_device(command)) {
        return run_on_device(command);
    }
    complete_simulation_options(command);
    refuse_without_output(command.stages, !command.options.out_csv.empty() || !command.json_lines.empty(),
                          "add --out FILE or --json-lines -");
    command.options.json_lines = !command.json_lines.empty();
    command.options.show_live = !command.json;
    const RunReport report = run_simulated(command.options);
    print_result(run_result(report), command.json, run_text);
    if (!command.json && command.json_lines.empty() && is_built(Component::web) && !fixed_method(command.options.tracker)) {
        print_text("see it: {}\n", see_it_command(*command.app, command.shared_options));
    }
    if (!command.json && !command.options.wav.empty()) {
        print_text("demodulate it: {}\n", demodulate_command(*command.app, command.options.wav, report.plan));
    }
    if (!report.recording_error.empty()) {
        throw DeviceError(report.recording_error);
    }
    if (!command.options.couplings.empty() && report.coupling_poses == 0) {
        print_notice("tricoil: {}: not written, because no pose has couplings: {}\n", command.options.couplings,
                     to_text(report.seen_flags));
        return to_int(ExitCode::check_failed);
    }
    if (report.score.scored == 0 && report.score.invalid > 0) {
        print_notice("tricoil: no valid pose: {}\n", advice_without_poses(report.seen_flags));
        // Couplings for a calibration do not need valid poses of this tracker.
        return to_int(command.options.couplings.empty() ? ExitCode::check_failed : ExitCode::fine);
    }
    return to_int(ExitCode::fine);
}

bool is_on_device(const RunCommand& command) { return command.device != "sim:" || !command.config.empty(); }

void complete_simulation_options(RunCommand& command) {
    check_vector(command.place, "--place");
    refuse_if(!command.wiring.empty(), "--wiring: only with a device; see --fault reversed_coil and swapped_coils");
    if (!command.options.hemisphere.empty()) {
        check_vector(command.options.hemisphere, "--hemisphere");
    }
    const RunOptions& o = command.options;
    check_outputs({{"--out", o.out_csv}, {"--couplings", o.couplings}, {"--record-wav", o.wav}, {"--samples", o.samples}},
                  {o.scenario.ends_with(".toml") ? o.scenario : "", o.trajectory, o.calibration});
    check_reference(command.options.output, command.options.stations, "; --stations sets how many there are");
    command.options.place_m = Vec3<double>(command.place[0], command.place[1], command.place[2]);
    if (command.duration->count() > 0) {
        command.options.duration_s = command.duration_s;
    }
}

}  // namespace tricoil::host
