#include "board/record/recorded_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "board/support/errors.hpp"
#include "board/support/tracker_choice.hpp"

namespace tricoil::host {
namespace {

/// The first intervals between low columns of one source coil. Empty without columns of two bands.
std::vector<double> intervals_s(const std::string& recording) {
    constexpr std::size_t kIntervals = 50;
    RecordLines lines(recording, RecordFile::inputs);
    std::optional<Column<double>> last;
    std::vector<double> intervals;
    for (std::string line; intervals.size() < kIntervals && lines.next(line);) {
        const TrackerInput input = parse_input(line, lines.where());
        const Column<double>& column = input.column;
        if (!has_couplings(input) || !column.flags.has(ColumnFlag::low_band) || (last && last->state != column.state)) {
            continue;
        }
        if (last && column.midpoint > last->midpoint) {
            intervals.push_back(to_seconds(column.midpoint - last->midpoint));
        }
        last = column;
    }
    return intervals;
}

/// Mean without those over lost frames. The mean, because time stamps are whole microseconds.
double mean_of_complete(const std::vector<double>& intervals) {
    const double longest_s = 1.5 * *std::min_element(intervals.begin(), intervals.end());
    double sum_s = 0;
    int complete = 0;
    for (const double interval_s : intervals) {
        sum_s += interval_s <= longest_s ? interval_s : 0;
        complete += interval_s <= longest_s ? 1 : 0;
    }
    return sum_s / complete;
}

}  // namespace

std::optional<TrackerSettings> settings_of(const Recording& recording, const std::string& tracker) {
    std::optional<TrackerSettings> settings = recording.settings();
    if (tracker.empty() || (settings && tracker == name_of_method(settings->tracker.method))) {
        return settings;
    }
    const tracking::MethodParams<double> method = method_of_name(tracker);
    if (!settings) {
        throw InputError(recording.folder() + ": has no columns to track: the device computed the poses; leave the tracker out");
    }
    settings->tracker.method = method;
    if (auto* bands = std::get_if<tracking::DualBandParams>(&settings->tracker.method)) {
        tracking::set_frame(*bands, two_band_frame_s(recording.folder()));
    }
    deskew_in_turn(settings->tracker);
    const Status status = tracking::AnyTracker::check(settings->tracker, settings->calibration);
    if (!status.ok()) {
        throw InputError(fmt::format("{}: --tracker {}: {}", recording.folder(), tracker, status.message()));
    }
    return settings;
}

void TrackerStage::do_begin(const Settings& settings) {
    next_.begin(settings);
    trackers_.clear();
    for (int n = 0; n < settings.sensors; ++n) {
        trackers_.push_back(std::make_unique<tracking::AnyTracker>(settings.tracker, settings.calibration));
    }
    for (ContinuedSequence& sequence : sequences_) {
        sequence.begin();
    }
}

void TrackerStage::pass(std::optional<tracking::PoseEstimate<double>> pose) {
    if (pose) {
        pose->sequence = sequences_.at(pose->sensor).next(pose->sequence);
        next_.pose(*pose);
    }
}

void TrackerStage::do_column(const MeasuredColumn<double>& column) {
    next_.column(column);
    pass(trackers_.at(column.sensor)->update(column));
}

void TrackerStage::do_tick(std::uint8_t sensor, DeviceTime now) {
    next_.tick(sensor, now);
    pass(trackers_.at(sensor)->tick(now));
}

void TrackerStage::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    next_.hemisphere(sensor, towards);
    (void)trackers_.at(sensor)->set_hemisphere(towards);  // a refused hemisphere is refused again
}

RecordedSource::RecordedSource(const Recording& recording, const std::optional<TrackerSettings>& settings,
                               tracking::TrackerTap<double>& tap)
    : settings_(settings), tap_(tap), lines_(recording.folder(), settings ? RecordFile::inputs : RecordFile::poses) {
    if (settings_) {
        tap_.begin(*settings_);
    }
}

/// A line is read in one step and passed in the next, so that a loop at the pace of the recording can wait between them.
bool RecordedSource::advance(Microseconds /*patience*/) {
    if (std::exchange(has_line_, false)) {
        play();
        ++played_;
        return true;
    }
    has_line_ = read();
    has_ended_ = !has_line_;
    if (has_line_ && begins()) {
        stamps_.restart();
    }
    if (const auto now = time(); has_line_ && now) {
        stamps_.follow(*now);
    }
    return has_line_;
}

bool RecordedSource::read() {
    std::string line;
    if (!lines_.next(line)) {
        return false;
    }
    if (!settings_) {
        pose_ = parse_pose(line, lines_.where());
        return true;
    }
    input_ = parse_input(line, lines_.where());
    if (input_.kind != InputKind::begin && input_.sensor >= settings_->sensors) {
        throw InputError(
            fmt::format("{}: sensor {} does not exist; the recording has {}", lines_.where(), input_.sensor, settings_->sensors));
    }
    return true;
}

std::optional<DeviceTime> RecordedSource::time() const {
    if (!settings_) {
        return pose_.time;
    }
    return input_.kind == InputKind::column ? std::optional(input_.column.midpoint)
           : input_.kind == InputKind::tick ? std::optional(input_.now)
                                            : std::nullopt;
}

void RecordedSource::play() {
    if (!settings_) {
        tap_.pose(pose_);
        return;
    }
    switch (input_.kind) {
        case InputKind::begin:
            tap_.begin(*settings_);
            break;
        case InputKind::column:
            tap_.column(input_.column);
            break;
        case InputKind::tick:
            tap_.tick(input_.sensor, input_.now);
            break;
        case InputKind::hemisphere:
            tap_.hemisphere(input_.sensor, input_.hemisphere);
            break;
    }
}

double two_band_frame_s(const std::string& recording) {
    const std::vector<double> intervals = intervals_s(recording);
    refuse_if(intervals.empty(), "{}: has no columns of two bands; record with --mux dual-band, or with a device in this mode",
              recording);
    const double frame_s = mean_of_complete(intervals);
    refuse_if(tracking::dual_band_params(frame_s).window_frames == 0,
              "{}: 0.1 to 0.2 s hold no whole number of its frames; record at another frame rate", recording);
    return frame_s;
}

}  // namespace tricoil::host
