#include "board/record/replay.hpp"

#include <array>
#include <cmath>

#include "board/pose_text/pose_stages.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/recorded_truth.hpp"
#include "board/stream/stream_loop.hpp"
#include "board/support/output_file.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::host {
namespace {

using Pose = tracking::PoseEstimate<double>;

/// Line of a pose without its sequence number (second field).
std::string without_sequence(const std::string& line) {
    const std::size_t begin = line.find(',');
    const std::size_t end = line.find(',', begin + 1);
    return end == std::string::npos ? line : line.substr(0, begin) + line.substr(end);
}

/// Compares replayed and recorded poses: one by one if the recording has the start of the trackers, otherwise by sensor and
/// time.
class Comparison {
public:
    Comparison(const std::string& folder, bool one_by_one, ReplayReport& report)
        : recorded_(folder, RecordFile::poses), one_by_one_(one_by_one), counts_on_(one_by_one), report_(report) {
        advance();
    }

    void add(const Pose& replayed, const std::string& line) {
        replayed_until_ = replayed.time;
        while (!one_by_one_ && at_ && at_->time < replayed.time) {
            ++report_.only_recorded;
            advance();
        }
        if (!at_ || (!one_by_one_ && (at_->time != replayed.time || at_->sensor != replayed.sensor))) {
            ++report_.only_replayed;
            return;
        }
        ++report_.compared;
        if (counts_on_ ? line_ == line : without_sequence(line_) == without_sequence(line)) {
            ++report_.equal;
        } else if (report_.first_difference.empty()) {
            report_.first_difference = recorded_.where();
        }
        if (at_->valid() && replayed.valid()) {
            ++both_valid_;
            position_squared_ += (at_->position_m - replayed.position_m).squaredNorm();
            orientation_squared_ += std::pow(geometry::angle_between(at_->q_source_sensor, replayed.q_source_sensor), 2);
        }
        advance();
    }

    void finish() {
        for (; at_; advance()) {
            ++report_.only_recorded;
        }
        report_.tail_s = std::abs(to_seconds(recorded_until_) - to_seconds(replayed_until_));
        if (both_valid_ > 0) {
            report_.rms_position_m = std::sqrt(position_squared_ / static_cast<double>(both_valid_));
            report_.rms_orientation_rad = std::sqrt(orientation_squared_ / static_cast<double>(both_valid_));
        }
    }

private:
    void advance() {
        at_.reset();
        if (recorded_.next(line_)) {
            at_ = parse_pose(line_, recorded_.where());
            recorded_until_ = at_->time;
            auto& next = next_sequence_.at(at_->sensor);
            counts_on_ = counts_on_ && at_->sequence >= next;
            next = at_->sequence + 1;
        }
    }

    RecordLines recorded_;
    bool one_by_one_;
    bool counts_on_;  // until the recording, an older one, counts from zero again after a start of its trackers
    std::array<std::uint32_t, tracking::kMaxSensors> next_sequence_{};
    ReplayReport& report_;
    std::string line_;
    std::optional<Pose> at_;  // next recorded pose; none at the end
    DeviceTime recorded_until_{};
    DeviceTime replayed_until_{};
    std::uint64_t both_valid_ = 0;
    double position_squared_ = 0;
    double orientation_squared_ = 0;
};

/// Errors of the poses of the first sensor against the true ones of a recorded simulation, scored like those of its run.
class TrueErrors {
public:
    explicit TrueErrors(const Recording& recording) : truth_(recording), begins_(!recording.midway()) {}

    void add(const Pose& pose) {
        const auto truth = truth_.at(pose.sensor, pose.time);
        settled_ = settled_.value_or((begins_ ? DeviceTime{} : pose.time) + microseconds_from_seconds(kScoreSettling_s));
        const double range_m = truth && pose.sensor == 0 ? truth->position_m.norm() : 0;
        if (pose.valid() && pose.time >= *settled_ && range_m >= kNearestScored_m && range_m <= kFarthestScored_m) {
            error_m_.push_back((pose.position_m - truth->position_m).norm());
            error_rad_.push_back(geometry::angle_between(pose.q_source_sensor, truth->q_source_sensor));
        }
    }

    void finish(ReplayReport& report) {
        report.scored = error_m_.size();
        report.error_m = summarise(std::move(error_m_));
        report.error_rad = summarise(std::move(error_rad_));
    }

private:
    RecordedTruth truth_;
    bool begins_;  // the simulation and its clock begin with the recording
    std::optional<DeviceTime> settled_;
    std::vector<double> error_m_;
    std::vector<double> error_rad_;
};

}  // namespace

ReplayReport replay(const Recording& recording, const TrackerSettings& settings, const std::string& out,
                    const OutputOptions& options, const ShowShare& progress) {
    ReplayReport report;
    const bool same_tracker = settings_json(settings) == settings_json(*recording.settings());
    Comparison comparison(recording.folder(), same_tracker && !recording.midway(), report);
    TrueErrors errors(recording);
    std::optional<OutputFile> file;
    PoseUnits units;
    PoseTap written([&](const Pose& pose) { file->write(pose_line({pose}, PoseFormat::csv, kRecordedForm, units)); });
    PoseStages stages(options, written);
    if (!out.empty()) {
        file.emplace(out);
        units = stages.units();
        file->write(pose_column_names(kRecordedForm, units) + '\n');
    }
    PoseTap replayed([&](const Pose& pose) {
        ++report.poses;
        report.valid_poses += pose.valid() ? 1U : 0U;
        comparison.add(pose, line_of(pose));
        errors.add(pose);
        if (file) {
            stages.pose(pose);
        }
    });
    TrackerStage trackers(replayed);
    RecordedSource source(recording, settings, trackers);
    run_to_end(source, [&] {
        if (progress) {
            progress(source.share());
        }
    });
    report.inputs = source.played();
    stages.finish();
    comparison.finish();
    errors.finish(report);
    if (file) {
        file->commit();
    }
    return report;
}

}  // namespace tricoil::host
