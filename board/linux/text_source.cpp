#include "board/linux/text_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "board/linux/column_timing.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/record/record_lines.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/table.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr std::size_t kPeriods = 5;  // whose median is the period
/// Exact rates are whole numbers; stamps in microseconds are rounded.
double rate_of(double period_us) {
    const double rate_hz = 1e6 / period_us;
    const double whole = std::round(rate_hz);
    return whole >= 1 && std::abs(rate_hz - whole) < 2e-3 * whole ? whole : rate_hz;
}
struct Intervals {
    std::vector<double> periods_us;  // from a coil of a sensor to the same coil
    std::size_t ties = 0;            // frames with the time of the one before, of another coil
};
Intervals intervals_of(const std::vector<TextFrame>& frames) {
    Intervals intervals;
    for (auto frame = frames.begin() + 1; frame != frames.end(); ++frame) {
        const auto newest_before = [&](bool is_same_coil) {
            return std::find_if(std::make_reverse_iterator(frame), frames.rend(), [&](const TextFrame& f) {
                return f.sensor == frame->sensor && (f.first_coil == frame->first_coil) == is_same_coil && f.time_us &&
                       frame->time_us;
            });
        };
        const auto same = newest_before(true);
        const auto other = newest_before(false);
        if (same != frames.rend() && *frame->time_us > *same->time_us) {
            intervals.periods_us.push_back(*frame->time_us - *same->time_us);
        }
        intervals.ties += other != frames.rend() && *frame->time_us == *other->time_us ? 1U : 0U;
    }
    return intervals;
}

/// Number of frames that is always enough.
constexpr std::size_t kFirstFrames = 32;

/// What the keys of the name do not tell follows from `frames`, which must not be empty. is_all: more frames do not come.
/// Nullopt: more are needed.
std::optional<TextTiming> timing_of(const std::vector<TextFrame>& frames, const TextName& name, bool is_all) {
    auto [periods_us, ties] = intervals_of(frames);
    const bool is_matrix = frames.front().coils > 1;
    if (!is_all && periods_us.size() < kPeriods && frames.size() < kFirstFrames && !(is_matrix && name.rate_hz)) {
        return std::nullopt;
    }
    TextTiming timing;
    const bool is_simultaneous = is_matrix || 2 * ties > frames.size() - 1;
    timing.multiplexing = name.multiplexing.value_or(is_simultaneous ? signal::Multiplexing::fdm : signal::Multiplexing::tdm);
    if (!periods_us.empty()) {
        const auto middle = periods_us.begin() + static_cast<std::ptrdiff_t>(periods_us.size() / 2);
        std::nth_element(periods_us.begin(), middle, periods_us.end());
        timing.rate_hz = std::clamp(rate_of(*middle), TextName::kSlowest_hz, TextName::kFastest_hz);
    }
    timing.rate_hz = name.rate_hz.value_or(timing.rate_hz);
    return timing;
}

constexpr Microseconds kShortestSilence{150'000};
constexpr Microseconds kMostBetweenStamps{3'600'000'000};  // one may be wrong
constexpr double kRestartUs = -1e6;                        // of the clock of a device
constexpr int kSilentFrames = 3;
constexpr Microseconds kNoticeAfter{1'000'000};
constexpr int kMostLines = 256;  // per step, so that a flood does not delay signals

/// What a text source cannot have.
void refuse_device_options(const DeviceConfig& config) {
    const auto refuse = [&](bool is_given, const char* what) {
        host::refuse_if(is_given, "{}: {}: only with a device on a link", config.device, what);
    };
    refuse(config.coils.has_value(), "[coils]");
    refuse(config.serial != 0, "serial");
    refuse(config.publish, "publish");
    refuse(config.priority > 0, "priority");
}

}  // namespace

TextSource::TextSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                       tracking::TrackerTap<double>& tap)
    : device_(config.device),
      name_(parse_text_name(config.device)),
      params_(loop_params(config, calibration)),
      taps_{&poses_, &tap},
      trackers_(taps_),
      lines_(device_.substr(0, device_.find(':') + 1) + name_.where, name_.where),
      notice_(device_) {
    refuse_device_options(config);
    host::refuse_if(params_.session.dual_band, "{}: columns of one band; use --tracker direct, previous or scaat", device_);
}

void TextSource::PoseWatch::do_pose(const tracking::PoseEstimate<double>& pose) {
    ++counters_.poses;
    counters_.valid_poses += pose.valid() ? 1U : 0U;
    counters_.flags |= pose.flags;
    newest_ = pose.flags;
    sides_[pose.sensor] = restorers_[pose.sensor].side(pose, now_);
}

bool TextSource::advance(Microseconds patience) {
    if (discards_ && is_live()) {
        discard();
        return !lines_.has_ended();
    }
    const int most = is_lossy() ? kMostLines : 1;
    auto line = lines_.next(std::min(patience, kLongestStep));
    for (int n = 0; line && n < most; ++n) {
        ++counters_.lines;
        try {
            if (const auto frame = parse(*line)) {
                take_frame(*frame);
            }
        } catch (const host::InputError& error) {
            ++counters_.refused_lines;
            if (!is_live()) {
                throw host::InputError(fmt::format("{}:{}: {}", name_.where, lines_.line(), error.what()));
            }
            notice_.print(fmt::format("line {}: {}", lines_.line(), error.what()));
        }
        line = n + 1 < most ? lines_.next(Microseconds{0}) : std::nullopt;
    }
    if (lines_.has_ended() && !has_begun_ && !first_frames_.empty()) {
        begin(*timing_of(first_frames_, name_, true));
    }
    tick();
    return !lines_.has_ended();
}

/// After a pause. Names of columns are learned all the same.
void TextSource::discard() {
    auto line = lines_.next(Microseconds{0});
    for (int n = 0; line && n < kMostLines; ++n) {
        try {
            (void)parse(*line);
        } catch (const host::InputError&) {  // not tracked anyway
        }
        line = lines_.next(Microseconds{0});
    }
    discards_ = line.has_value();
    arrival_ = drivers::host_now();
    for (Stream& stream : streams_) {
        stream.arrival = arrival_;
    }
}

/// During silence of a sensor, its poses are flagged stale.
void TextSource::tick() {
    if (!is_live() || !has_begun_) {
        return;
    }
    const HostTime now = drivers::host_now();
    if (now - arrival_ > std::max(kNoticeAfter, silence_) && !std::exchange(is_silent_, true)) {
        notice_.print(fmt::format("no column for {:.1f} s", to_seconds(now - arrival_)));
    }
    for (std::size_t sensor = 0; sensor < streams_.size(); ++sensor) {
        const Stream& stream = streams_[sensor];
        if (stream.newest && now - stream.arrival > silence_) {
            trackers_.tick(static_cast<std::uint8_t>(sensor), *stream.newest + (now - stream.arrival));
        }
    }
}

void TextSource::follow_sender() {
    if (std::exchange(sender_, lines_.sender()) == lines_.sender()) {
        return;
    }
    is_of_coils_ = false;
    rows_.restart();
    if (lines_.has_clients()) {  // another device, with a clock and a rate of its own
        start_again();
    }
}

void TextSource::start_again() {
    first_frames_.clear();
    has_begun_ = false;
    has_new_clock_ = true;
    for (Stream& stream : streams_) {
        stream.frames = 0;
        stream.last_us.reset();
        stream.sequence.begin();
    }
}

std::optional<TextFrame> TextSource::parse(std::string_view line) {
    follow_sender();
    host::refuse_if(line.find('\0') != std::string_view::npos, "binary data; {}", host::kNeedsText);
    host::refuse_if(lines_.was_cut(), "the line is longer than {} KiB", LineInput::kLongestLine >> 10U);
    is_of_coils_ = is_of_coils_ || line.starts_with(host::kOfCoilsComment);
    host::refuse_if(is_of_coils_ && params_.session.has_wiring, "the wiring is corrected already; leave out --wiring");
    if (!has_poses(device_)) {
        return rows_.parse(line);
    }
    if (line.empty() || line.front() == '#' || line.starts_with("sensor,")) {  // comment, names
        return std::nullopt;
    }
    TextFrame frame;
    frame.pose = host::parse_pose(line, "a line of a recording's poses.csv is needed");
    frame.sensor = frame.pose->sensor;
    frame.time_us = static_cast<double>(frame.pose->time.since_start().count());
    check_time(*frame.time_us);
    frame.coils = kSourceCoils;  // at one time
    return frame;
}

void TextSource::take_frame(const TextFrame& frame) {
    if (frame.sensor >= name_.sensors) {
        throw host::InputError(
            fmt::format("sensor {}: add ,sensors={} to the name of the source", frame.sensor, frame.sensor + 1));
    }
    host::refuse_if(!frame.pose && !frame.sigma && !name_.sigma,
                    "no sigma: add ,sigma=S to the name of the source, the standard deviation of a coupling");
    host::refuse_if(!frame.time_us && !(frame.coils > 1 && name_.rate_hz),
                    "no time: needs time_us or time_s, or couplings x11 to x33 with the key ,rate_hz=R");
    if (frame.time_us) {
        const double step_us = *frame.time_us - std::exchange(streams_[frame.sensor].last_us, frame.time_us).value_or(-1e300);
        host::refuse_if((step_us < 0 || (step_us == 0 && frame.coils > 1)) && !(is_live() && step_us < kRestartUs),
                        "time {} us is not later than that of the line before", *frame.time_us);
    }
    if (has_begun_) {
        track(frame);
        return;
    }
    first_frames_.push_back(frame);
    if (const auto known = timing_of(first_frames_, name_, false)) {
        begin(*known);
    }
}

void TextSource::begin(const TextTiming& timing) {
    timing_ = timing;
    host::refuse_if(!is_live() && !name_.rate_hz && timing.rate_hz >= TextName::kFastest_hz,
                    "{}: the times give {} frames a second or more; are they in another unit? Else add ,rate_hz=R", device_,
                    timing.rate_hz);
    const Microseconds some_frames = kSilentFrames * microseconds_from_seconds(1 / timing.rate_hz);
    silence_ = std::max(kShortestSilence, some_frames);
    auto settings = tracker_settings(params_, name_.sensors, timing.multiplexing, timing.rate_hz);
    tracking::CommonParams<double>& common = settings.tracker.common;
    common.lost_after = std::max(common.lost_after, some_frames);
    common.search_after = std::max(common.search_after, 2 * some_frames);
    if (!first_frames_.front().has_quadrature) {
        common.quadrature_floor = 1;
        if (settings.calibration) {
            settings.calibration->quadrature_floor = 1;
            settings.calibration->surroundings_lag = {};
        }
    }
    if (const Status status = tracking::AnyTracker::check(settings.tracker, settings.calibration); !status.ok()) {
        throw host::DeviceError(
            fmt::format("{}: at {:g} frames a second: {}; try --tracker direct", device_, timing.rate_hz, status.message()));
    }
    trackers_.begin(settings);
    has_begun_ = true;
    for (std::size_t sensor = 0; sensor < static_cast<std::size_t>(name_.sensors); ++sensor) {
        if (const auto wanted = std::exchange(streams_[sensor].wanted_hemisphere, std::nullopt)) {
            set_hemisphere(sensor, *wanted);
        } else if (poses_.has_tracked(sensor) && !common.confined) {  // it may have left the half space of the configuration
            set_hemisphere(sensor, Vec3<double>::Zero());
        }
    }
    for (const TextFrame& frame : std::exchange(first_frames_, {})) {
        track(frame);
    }
}

void TextSource::track(const TextFrame& frame) {
    Stream& stream = streams_[frame.sensor];
    MeasuredColumn<double> column;
    column.sensor = frame.sensor;
    column.midpoint = continued(frame.time_us.value_or(1e6 * stream.frames / timing_.rate_hz));
    column.flags = frame.flags;
    column.sigma = frame.sigma.value_or(Vec3<double>::Constant(name_.sigma.value_or(0)));
    ++stream.frames;
    follow_clock(stream, column.midpoint);
    if (frame.pose) {
        ++counters_.columns;
        tracking::PoseEstimate<double> pose = *frame.pose;
        pose.time = column.midpoint;
        pose.sequence = stream.sequence.next(pose.sequence);
        taps_.pose(pose);
        return;
    }
    for (int n = 0; n < frame.coils; ++n) {
        column.state = single_coil(frame.first_coil + n);
        column.in_phase = frame.in_phase[static_cast<std::size_t>(n)];
        column.quadrature = frame.quadrature[static_cast<std::size_t>(n)];
        column.sequence = columns_;
        column.state_sequence = timing_.multiplexing == signal::Multiplexing::tdm ? columns_ : columns_ / kSourceCoils;
        ++columns_;
        ++counters_.columns;
        trackers_.column(params_.wiring.of_coils(column));
        if (const auto side = poses_.take_side(frame.sensor); side && is_live()) {  // a file has no other clock than its own
            ++counters_.hemispheres_restored;
            trackers_.hemisphere(frame.sensor, *side);
        }
    }
}

/// Time of a line. If the clock of a new sender is behind that of the one before, it goes on from the newest time, by the host's
/// time since then; unless so many senders came that no time is left.
DeviceTime TextSource::continued(double time_us) {
    const DeviceTime time = device_time_us(std::llround(time_us));
    if (const auto newest = stamps_.newest(); std::exchange(has_new_clock_, false) && newest) {
        const DeviceTime next = *newest + std::max(drivers::host_now() - arrival_, Microseconds{1});
        offset_ = time <= *newest && next < device_time_us(std::llround(kLatestTime_us)) ? next - time : Microseconds{};
    }
    return time + offset_;
}

/// A pipe may hold old lines: then more time has passed in them than here.
void TextSource::follow_clock(Stream& stream, DeviceTime now) {
    const HostTime host_now = drivers::host_now();
    const Microseconds of_stamps = std::min(now - stamps_.newest().value_or(now), kMostBetweenStamps);
    clock_ += std::max(of_stamps, stamps_.newest() ? host_now - arrival_ : Microseconds{});
    poses_.set_clock(clock_);
    stamps_.follow(now);
    stream.newest = now;
    stream.arrival = arrival_ = host_now;
    is_silent_ = false;
}

bool TextSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    if (sensor >= static_cast<std::size_t>(name_.sensors)) {
        return false;
    }
    if (has_begun_) {
        trackers_.hemisphere(static_cast<std::uint8_t>(sensor), towards);
    } else {
        streams_[sensor].wanted_hemisphere = towards;
    }
    return true;
}

bool TextSource::is_steady() const { return stamps_.newest() && (!is_live() || drivers::host_now() - arrival_ <= silence_); }

std::optional<host::LinkState> TextSource::link_state() const {
    const HostTime now = drivers::host_now();
    host::HealthCounts counts;
    counts.received = counters_.columns;
    counts.refused = counters_.refused_lines;
    counts.age = is_live() && stamps_.newest() ? now - arrival_ : Microseconds{};
    return host::LinkState{counts, now - HostTime{}};
}

std::string TextSource::status() const {
    return lines_.has_ended() ? "the lines have ended" : stamps_.newest() ? "running" : "waiting for the first line";
}

nlohmann::ordered_json TextSource::summary() const {
    return {{"device", device_},
            {"lines", counters_.lines},
            {"lines_refused", counters_.refused_lines},
            {"columns", counters_.columns},
            {"poses", counters_.poses},
            {"poses_valid", counters_.valid_poses},
            {"hemispheres_restored", counters_.hemispheres_restored},
            {"flags_seen", host::to_text(counters_.flags)}};
}

std::string TextSource::text_of(const nlohmann::ordered_json& summary) const {
    return host::fill(summary,
                      "{device}: {poses} poses, {poses_valid} valid\n"
                      "  lines    {lines} read, {lines_refused} refused; {columns} columns; flags of the poses: {flags_seen}\n");
}

std::string TextSource::advice_without_poses() const {
    if (counters_.columns == 0) {
        return counters_.refused_lines > 0 ? "every line was refused" : "no columns came";
    }
    const bool is_whole = counters_.poses > 0 && !counters_.flags.has(tracking::PoseFlag::columns_missing);
    const std::string flags = counters_.poses > 0 ? host::advice_without_poses(counters_.flags) : "";
    return is_whole ? flags : flags + (flags.empty() ? "" : "; ") + "do the times, state, mux and rate_hz of the columns agree?";
}

}  // namespace tricoil::linux_board
