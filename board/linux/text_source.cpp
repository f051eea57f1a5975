#include "board/linux/text_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "board/linux/column_timing.hpp"
#include "board/support/errors.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kShortestSilence{150'000};
constexpr Microseconds kLongestStep_us{3'600'000'000};  // of stamps; one may be wrong
constexpr int kSilentFrames = 3;
constexpr Microseconds kNoticeAfter{1'000'000};
constexpr Microseconds kLongestGap{1'000'000};
constexpr int kMostLines = 256;  // per step, so that a flood does not delay signals
constexpr std::size_t kFirstFrames = 32;
constexpr std::size_t kPeriods = 5;  // whose median is the period

/// What a text source cannot have.
void refuse_device_options(const DeviceConfig& config) {
    const auto refuse = [&](bool is_given, const char* what) {
        if (is_given) {
            throw host::InputError(fmt::format("{}: {}: only with a device on a link", config.device, what));
        }
    };
    refuse(config.coils.has_value(), "[coils]");
    refuse(config.serial != 0, "serial");
    refuse(config.publish, "publish");
    refuse(config.priority > 0, "priority");
}

/// Exact rates are whole numbers; stamps in microseconds are rounded.
double rate_of(double period_us) {
    const double rate_hz = 1e6 / period_us;
    const double whole = std::round(rate_hz);
    return whole >= 1 && std::abs(rate_hz - whole) < 2e-3 * whole ? whole : rate_hz;
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
    if (params_.session.dual_band) {
        throw host::InputError(device_ + ": columns of one band; use --tracker direct, previous or scaat");
    }
}

void TextSource::PoseWatch::do_pose(const tracking::PoseEstimate<double>& pose) {
    ++counters_.poses;
    counters_.valid_poses += pose.valid() ? 1U : 0U;
    counters_.flags |= pose.flags;
    constexpr auto kHemisphereUnknown = tracking::PoseFlag::hemisphere_unknown;
    newest_ = {};
    newest_.set_if(pose.flags.has(kHemisphereUnknown), kHemisphereUnknown);
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
            take(*line);
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
        begin(*timing(true));
    }
    tick();
    return !lines_.has_ended();
}

/// After a pause. Names of columns are learned all the same.
void TextSource::discard() {
    auto line = lines_.next(Microseconds{0});
    for (int n = 0; line && n < kMostLines; ++n) {
        try {
            if (std::exchange(sender_, lines_.sender()) != lines_.sender()) {
                rows_.restart();
            }
            (void)rows_.parse(*line);
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
        notice_.print("no column for 1 s");
    }
    for (std::size_t sensor = 0; sensor < streams_.size(); ++sensor) {
        const Stream& stream = streams_[sensor];
        if (stream.newest && now - stream.arrival > silence_) {
            trackers_.tick(static_cast<std::uint8_t>(sensor), *stream.newest + (now - stream.arrival));
        }
    }
}

void TextSource::take(std::string_view line) {
    if (std::exchange(sender_, lines_.sender()) != lines_.sender()) {
        rows_.restart();
        if (lines_.has_clients()) {  // another device, with a clock and a rate of its own
            first_frames_.clear();
            has_begun_ = false;
        }
    }
    if (const auto frame = rows_.parse(line)) {
        take_frame(*frame);
    }
}

void TextSource::take_frame(const TextFrame& frame) {
    if (frame.sensor >= name_.sensors) {
        throw host::InputError(
            fmt::format("sensor {}: add ,sensors={} to the name of the source", frame.sensor, frame.sensor + 1));
    }
    if (!frame.sigma && !name_.sigma) {
        throw host::InputError("no sigma: add ,sigma=S to the name of the source, the standard deviation of a coupling");
    }
    if (!frame.time_us && !(frame.coils > 1 && name_.rate_hz)) {
        throw host::InputError("no time: needs time_us or time_s, or couplings x11 to x33 with the key ,rate_hz=R");
    }
    if (has_begun_) {
        track(frame);
        return;
    }
    first_frames_.push_back(frame);
    if (const auto known = timing(first_frames_.size() == kFirstFrames)) {
        begin(*known);
    }
}

/// From the times of the first frames, unless the keys tell. is_all: more frames do not come; nullopt is not returned.
std::optional<TextSource::Timing> TextSource::timing(bool is_all) const {
    std::vector<double> periods_us;  // from a coil of a sensor to the same coil
    int ties = 0;                    // frames with the time of the one before
    for (std::size_t n = 1; n < first_frames_.size(); ++n) {
        const TextFrame& frame = first_frames_[n];
        const auto is_before = [&](const TextFrame& f, bool is_same_coil) {
            return f.sensor == frame.sensor && (f.first_coil == frame.first_coil) == is_same_coil && f.time_us && frame.time_us;
        };
        const auto end = first_frames_.rend();
        const auto from = end - static_cast<std::ptrdiff_t>(n);
        const auto same = std::find_if(from, end, [&](const TextFrame& f) { return is_before(f, true); });
        const auto other = std::find_if(from, end, [&](const TextFrame& f) { return is_before(f, false); });
        if (same != end && *frame.time_us > *same->time_us) {
            periods_us.push_back(*frame.time_us - *same->time_us);
        }
        ties += other != end && *frame.time_us == *other->time_us ? 1 : 0;
    }
    const bool is_matrix = first_frames_.front().coils > 1;
    const bool is_enough = is_all || periods_us.size() >= kPeriods || (is_matrix && name_.rate_hz);
    if (!is_enough) {
        return std::nullopt;
    }
    Timing timing;
    const bool is_simultaneous = is_matrix || 2 * ties > static_cast<int>(first_frames_.size()) - 1;
    timing.multiplexing = name_.multiplexing.value_or(is_simultaneous ? signal::Multiplexing::fdm : signal::Multiplexing::tdm);
    if (!periods_us.empty()) {
        const auto middle = periods_us.begin() + static_cast<std::ptrdiff_t>(periods_us.size() / 2);
        std::nth_element(periods_us.begin(), middle, periods_us.end());
        timing.rate_hz = std::clamp(rate_of(*middle), TextName::kSlowest_hz, TextName::kFastest_hz);
    }
    timing.rate_hz = name_.rate_hz.value_or(timing.rate_hz);
    return timing;
}

void TextSource::begin(const Timing& timing) {
    timing_ = timing;
    const Microseconds some_frames = kSilentFrames * microseconds_from_seconds(1 / timing.rate_hz);
    silence_ = std::max(kShortestSilence, some_frames);
    tracking::TrackerTap<double>::Settings settings;
    settings.sensors = name_.sensors;
    settings.calibration = params_.calibration;
    settings.tracker.method = params_.method;
    tracking::CommonParams<double>& common = settings.tracker.common;
    common.coupling_constant = params_.coupling_constant_m3;
    common.hemisphere = params_.hemisphere;
    common.confined = params_.session.confined;
    common.lost_after = std::max(common.lost_after, some_frames);
    common.search_after = std::max(common.search_after, 2 * some_frames);
    set_timing(timing.multiplexing, timing.rate_hz, settings);
    if (!first_frames_.front().has_quadrature) {
        common.quadrature_floor = 1;
        if (settings.calibration) {
            settings.calibration->quadrature_floor = 1;
        }
    }
    if (const Status status = tracking::AnyTracker<double>::check(settings.tracker, settings.calibration); !status.ok()) {
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
    column.midpoint = device_time_us(std::llround(frame.time_us.value_or(1e6 * stream.frames / timing_.rate_hz)));
    column.flags = frame.flags;
    column.sigma = frame.sigma.value_or(Vec3<double>::Constant(name_.sigma.value_or(0)));
    ++stream.frames;
    follow_clock(stream, column.midpoint);
    for (int n = 0; n < frame.coils; ++n) {
        column.state = single_coil(frame.first_coil + n);
        column.in_phase = frame.in_phase[static_cast<std::size_t>(n)];
        column.quadrature = frame.quadrature[static_cast<std::size_t>(n)];
        column.sequence = columns_;
        column.state_sequence = timing_.multiplexing == signal::Multiplexing::tdm ? columns_ : columns_ / kSourceCoils;
        ++columns_;
        ++counters_.columns;
        trackers_.column(column);
        if (const auto side = poses_.take_side(frame.sensor); side && is_live()) {  // a file has no other clock than its own
            ++counters_.hemispheres_restored;
            trackers_.hemisphere(frame.sensor, *side);
        }
    }
}

/// Times of several sensors may go back by a little. A pipe may hold old lines: then more time has passed in them than here.
void TextSource::follow_clock(Stream& stream, DeviceTime now) {
    const HostTime host_now = drivers::host_now();
    const Microseconds of_stamps = std::min(now - newest_.value_or(now), kLongestStep_us);
    clock_ += std::max(of_stamps, newest_ ? host_now - arrival_ : Microseconds{});
    poses_.set_clock(clock_);
    elapsed_ += of_stamps.count() > 0 && of_stamps < kLongestGap ? of_stamps : Microseconds{};
    const bool is_earlier = of_stamps.count() < 0 && of_stamps > -kLongestGap;
    newest_ = is_earlier ? *newest_ : now;
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

bool TextSource::is_steady() const { return newest_ && (!is_live() || drivers::host_now() - arrival_ <= silence_); }

std::optional<host::LinkState> TextSource::link_state() const {
    const HostTime now = drivers::host_now();
    host::HealthCounts counts;
    counts.received = counters_.columns;
    counts.refused = counters_.refused_lines;
    counts.age = is_live() && newest_ ? now - arrival_ : Microseconds{};
    return host::LinkState{counts, now - HostTime{}};
}

std::string TextSource::status() const {
    return lines_.has_ended() ? "the lines have ended" : newest_ ? "running" : "waiting for the first line";
}

}  // namespace tricoil::linux_board
