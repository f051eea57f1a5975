// tricoil smooth: best estimate of a recorded motion.
#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/host/smooth/smoothing_tap.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/record/recorded_source.hpp"
#include "board/stream/stream_loop.hpp"
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
    OutputOptions stages;
    bool json = false;
};

/// Merges the poses of the sensors by time. The smoother delivers each sensor's poses in pieces.
class Merge {
public:
    Merge(int sensors, Smoother::Receiver next) : waiting_(static_cast<std::size_t>(sensors)), next_(std::move(next)) {}

    void take(const SmoothedPose& smoothed) {
        waiting_.at(smoothed.pose.sensor).push_back(smoothed);
        while (std::none_of(waiting_.begin(), waiting_.end(), [](const auto& poses) { return poses.empty(); })) {
            pass_oldest();
        }
    }
    /// Passes the rest.
    void finish() {
        while (std::any_of(waiting_.begin(), waiting_.end(), [](const auto& poses) { return !poses.empty(); })) {
            pass_oldest();
        }
    }

private:
    void pass_oldest() {
        const auto is_older = [](const auto& a, const auto& b) {
            return !a.empty() && (b.empty() || a.front().pose.time < b.front().pose.time);
        };
        auto& oldest = *std::min_element(waiting_.begin(), waiting_.end(), is_older);
        next_(oldest.front());
        oldest.pop_front();
    }

    std::vector<std::deque<SmoothedPose>> waiting_;  // of each sensor
    Smoother::Receiver next_;
};

struct Totals {
    std::size_t poses = 0;
    std::size_t valid = 0;
    double position_variance_m2 = 0;  // sum over the valid poses
};

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
    check_reference(command.stages, recording.sensors());
    Totals totals;
    SmoothedPose rates;                                      // of the pose that is in the stages
    const bool has_rates = command.stages.relative_to == 0;  // relative poses have none
    std::optional<PoseStages> stages;
    std::optional<OutputFile> file;
    PoseTap written([&](const tracking::PoseEstimate<double>& pose) {
        file->write(pose_line({pose, nullptr, has_rates ? &rates.velocity_m_s : nullptr, has_rates ? &rates.rate_rad_s : nullptr},
                              PoseFormat::csv, kSmoothedForm, stages->units()));
    });
    stages.emplace(command.stages, written);
    file.emplace(command.out);
    file->write(pose_column_names(kSmoothedForm, stages->units()) + "\n");
    Merge merge(recording.sensors(), [&](const SmoothedPose& smoothed) {
        ++totals.poses;
        if (smoothed.pose.valid()) {
            ++totals.valid;
            totals.position_variance_m2 += smoothed.pose.covariance.topLeftCorner<3, 3>().trace();
        }
        rates = smoothed;
        stages->turn_rates(rates.pose, rates.velocity_m_s, rates.rate_rad_s);
        stages->pose(smoothed.pose);
    });
    SmoothingTap tap([&](const SmoothedPose& smoothed) { merge.take(smoothed); });
    RecordedSource source(recording, recording.settings(), tap);
    Progress progress("smooth");
    run_to_end(source, [&] {
        progress.show(source.share());
        if (source.begins()) {
            tap.finish();  // the clock may start again
            merge.finish();
        }
    });
    tap.finish();
    merge.finish();
    stages->finish();
    refuse_if(totals.poses < 2, "{}: has {} poses; at least two are needed: record a longer run", command.recording,
              totals.poses);
    file->commit();
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
    folder_name(sub->add_option("recording", command->recording, "Folder written by run --record"))->required();
    file_name(sub->add_option("--out", command->out, "Write poses, covariances and rates to this CSV file"))->required();
    sub->add_flag("--json", command->json, "Summary as JSON");
    add_stage_options(sub, command->stages);
    set_examples(sub, {{"a recording of tricoil run --record", "tricoil smooth take1 --out path.csv"}});
    sub->callback([command, &action] { action = [command] { return smooth(*command); }; });
}

}  // namespace tricoil::host
