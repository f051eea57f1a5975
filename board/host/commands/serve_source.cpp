#include "board/host/commands/serve_command.hpp"
#include "board/linux/text_name.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/recorded_truth.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr double kUnlimited_s = 1e9;

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

/// Plays the recording at its own pace, of a simulation with its true poses.
int serve_recording(const Recording& recording, const std::string& tracker, LoopParams loop, tracking::TrackerTap<double>& tap) {
    RecordedTruth truth(recording);
    TapFanOut poses{&tap};
    poses.set_truth([&](std::uint8_t sensor, DeviceTime time) { return truth.at(sensor, time); });
    TrackerStage trackers(poses);
    RecordedSource source(recording, settings_of(recording, tracker), trackers);
    loop.realtime = true;
    StreamLoop(source, loop).run();
    return to_int(ExitCode::fine);
}

}  // namespace

std::optional<Recording> open_recording(const ServeCommand& command) {
    if (command.recording.empty()) {
        return std::nullopt;
    }
    for (const CLI::Option* option : command.of_other_sources) {
        refuse_if(option->count() > 0, "{}: not with a recording, which has its own; leave one of them out", option->get_name());
    }
    return std::optional<Recording>(command.recording);
}

nlohmann::ordered_json source_of(const ServeCommand& command) {
    if (!command.recording.empty()) {
        return {{"kind", "recording"}, {"recording", command.recording}};
    }
    const RunCommand& run = *command.run;
    if (!is_on_device(run)) {
        return describe_source(run.options);
    }
    const auto config = device_options(run).config;
    refuse_if(!command.record_folder.empty() && linux_board::has_poses(config.device),
              "--record-folder: poses have no columns; leave it out");
    return linux_board::describe_source(config);
}

int run_source(const ServeCommand& command, const std::optional<Recording>& recording, const LoopParams& loop,
               tracking::TrackerTap<double>& taps) {
    if (recording) {
        const std::string tracker = command.tracker->count() > 0 ? command.run->options.tracker : "";
        return serve_recording(*recording, tracker, loop, taps);
    }
    return is_on_device(*command.run) ? serve_device(*command.run, loop, taps) : serve_simulation(*command.run, loop, taps);
}

}  // namespace tricoil::host
