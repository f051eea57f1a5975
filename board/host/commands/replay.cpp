// tricoil replay: runs the recorded inputs of a run again.
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/replay.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

struct ReplayCommand {
    std::string folder;
    std::string tracker;  // empty: as recorded
    std::string out;
    OutputOptions stages;
    std::vector<const CLI::Option*> stage_options;
    bool json = false;
};

Json result_of(const Recording& recording, const ReplayReport& r, bool same_tracker) {
    return {{"recording", recording.folder()},
            {"complete", recording.complete()},
            {"inputs", r.inputs},
            {"poses", r.poses},
            {"poses_valid", r.valid_poses},
            {"compared", r.compared},
            {"equal", r.equal},
            {"only_replayed", r.only_replayed},
            {"only_recorded", r.only_recorded},
            {"expected_equal", same_tracker && !recording.midway()},
            {"bit_for_bit", same_tracker && r.reproduces(recording.complete())},
            {"difference_rms_m", r.rms_position_m},
            {"difference_rms_deg", kDegrees * r.rms_orientation_rad},
            {"poses_scored", r.scored},
            {"position_rms_m", r.scored == 0 ? Json(nullptr) : Json(r.error_m.rms)},
            {"orientation_rms_deg", r.scored == 0 ? Json(nullptr) : Json(kDegrees * r.error_rad.rms)}};
}

/// Why a recording is incomplete.
std::string reason_of(const Recording& recording) {
    const auto reason = recording.description().value("failure", Json());
    return reason.is_string() ? reason.get<std::string>() : "the recording program was killed, or could not write to the disk";
}

std::string replay_text(const Json& r, const Recording& recording) {
    std::string text = fill(r, "{recording}: {inputs} inputs, {poses} poses, {poses_valid} of them valid\n");
    text += r["complete"] ? "" : "  incomplete: " + reason_of(recording) + "\n";
    if (!r["expected_equal"]) {
        text += fill(r,
                     "  against the recorded poses: {compared} at the same times, {equal} of them equal, "
                     "{difference_rms_m in mm:.4f} mm and {difference_rms_deg:.5f} deg RMS apart\n");
    } else if (r["bit_for_bit"]) {
        text += fill(r, "  equals the recorded run bit for bit ({equal} poses)\n");
    }
    text += r["poses_scored"] == 0 ? ""
                                   : fill(r,
                                          "  against the true poses: {position_rms_m in mm:.3f} mm and "
                                          "{orientation_rms_deg:.4f} deg RMS ({poses_scored} poses)\n");
    return text;
}

int run_replay(const ReplayCommand& command) {
    const Recording recording(command.folder);
    if (!recording.settings()) {
        throw InputError(command.folder +
                         ": has no inputs to replay: the device computed the poses, or the run ended at its start");
    }
    refuse_without_output(command.stage_options, !command.out.empty(), "add --out FILE");
    check_reference(command.stages, recording.sensors());
    if (!command.out.empty()) {
        recording.refuse_as_output(command.out);
    }
    const TrackerSettings settings = *settings_of(recording, command.tracker);
    const bool same_tracker = settings_json(settings) == settings_json(*recording.settings());
    Progress progress("replay");
    const ReplayReport report = replay(recording, settings, command.out, command.stages, progress.part(0, 1));
    const Json result = result_of(recording, report, same_tracker);
    print_text(command.json ? json_line(result, 2) + "\n" : replay_text(result, recording));
    if (result["expected_equal"] && !result["bit_for_bit"]) {
        if (report.equal == report.compared) {
            print_notice("tricoil: {}: inputs and poses end {:.1f} s apart: one of the files is truncated\n", command.folder,
                         report.tail_s);
            return to_int(ExitCode::check_failed);
        }
        print_notice(
            "tricoil: {}: replay differs{}: {} of {} poses are equal; the recording was made by {}, this is tricoil {}\n",
            command.folder, report.first_difference.empty() ? "" : ", first at " + report.first_difference, report.equal,
            report.poses + report.only_recorded, recording.description().value("program", "an unknown program"), TRICOIL_VERSION);
        return to_int(ExitCode::check_failed);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_replay_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<ReplayCommand>();
    folder_name(sub->add_option("recording", command->folder, "Folder written by run --record"))->required();
    one_of(sub->add_option("--tracker", command->tracker, "Another tracker; default: as recorded"), kTrackerNames)
        ->check(refuse_empty);
    file_name(
        sub->add_option("--out", command->out, "Write the poses to this file, in the format of poses.csv; - is standard output"));
    sub->add_flag("--json", command->json, "Summary as JSON");
    command->stage_options = add_stage_options(sub, command->stages);
    set_examples(sub, {{"is the recorded run reproduced bit for bit?", "tricoil replay take1"},
                       {"with another tracker; its poses as CSV", "tricoil replay take1 --tracker direct --out direct.csv"}});
    sub->callback([command, &action] { action = [command] { return run_replay(*command); }; });
}

}  // namespace tricoil::host
