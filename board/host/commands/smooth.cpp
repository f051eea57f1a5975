// tricoil smooth: best estimate of a recorded motion.
#include <fmt/format.h>

#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/smooth/smoothing_tap.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/progress.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

struct SmoothCommand {
    std::string recording;
    std::string out;
    bool json = false;
};

struct Totals {
    std::size_t poses = 0;
    std::size_t valid = 0;
    double position_variance_m2 = 0;  // sum over the valid poses
};

/// Passes a recorded input to the smoother.
void take(const TrackerInput& input, const TrackerSettings& settings, SmoothingTap& tap, const std::string& where) {
    if (input.kind != InputKind::begin && input.sensor >= tap.sensors()) {
        throw InputError(fmt::format("{}: sensor {} does not exist; the recording has {}", where, input.sensor, tap.sensors()));
    }
    switch (input.kind) {
        case InputKind::column:
            tap.column(input.column);
            break;
        case InputKind::tick:
            tap.tick(input.sensor, input.now);
            break;
        case InputKind::hemisphere:
            tap.hemisphere(input.sensor, input.hemisphere);
            break;
        case InputKind::begin:
            tap.begin(settings);
    }
}

std::string smooth_text(const Json& r) {
    std::string text = fill(r, "{recording}: {poses} poses, {poses_valid} valid");
    if (r["poses_valid"] > 0) {
        text += fill(r, "; standard deviation of the position {position_std_m in mm:.4f} mm RMS");
    }
    return text + fill(r, "\nwrote {out}\n");
}

int smooth(const SmoothCommand& command) {
    const Recording recording(command.recording);
    if (!recording.settings()) {
        throw InputError(command.recording +
                         ": has no columns to smooth: the device computed the poses, or the run ended at its start");
    }
    recording.refuse_as_output(command.out);
    OutputFile file(command.out);
    file.write(pose_column_names(kSmoothedForm) + "\n");
    Totals totals;
    SmoothingTap tap([&](const SmoothedPose& smoothed) {
        ++totals.poses;
        if (smoothed.pose.valid()) {
            ++totals.valid;
            totals.position_variance_m2 += smoothed.pose.covariance.topLeftCorner<3, 3>().trace();
        }
        file.write(
            pose_line({smoothed.pose, nullptr, &smoothed.velocity_m_s, &smoothed.rate_rad_s}, PoseFormat::csv, kSmoothedForm));
    });
    tap.begin(*recording.settings());
    RecordLines inputs(command.recording, RecordFile::inputs);
    Progress progress("smooth");
    for (std::string line; inputs.next(line);) {
        progress.show(inputs.share());
        take(parse_input(line, inputs.where()), *recording.settings(), tap, inputs.where());
    }
    tap.finish();
    if (totals.poses < 2) {
        throw InputError(
            fmt::format("{}: has {} poses; at least two are needed: record a longer run", command.recording, totals.poses));
    }
    file.commit();
    const double count = std::max(1.0, static_cast<double>(totals.valid));
    print_result({{"recording", command.recording},
                  {"poses", totals.poses},
                  {"poses_valid", totals.valid},
                  {"position_std_m", std::sqrt(totals.position_variance_m2 / count)},
                  {"out", command.out}},
                 command.json, smooth_text);
    return to_int(ExitCode::fine);
}

}  // namespace

void add_smooth_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<SmoothCommand>();
    sub->add_option("recording", command->recording, "Folder written by run --record")
        ->required()
        ->check(refuse_empty)
        ->type_name(kFolderType);
    sub->add_option("--out", command->out, "Write poses, covariances and rates to this CSV file")
        ->required()
        ->check(refuse_empty)
        ->type_name(kFileType);
    sub->add_flag("--json", command->json, "Summary as JSON");
    set_examples(sub, {{"a recording of tricoil run --record", "tricoil smooth take1 --out path.csv"}});
    sub->callback([command, &action] { action = [command] { return smooth(*command); }; });
}

}  // namespace tricoil::host
