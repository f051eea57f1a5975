#include "board/linux/text_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "board/linux/column_timing.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kSilence{150'000};  // longest time without a column before poses are flagged stale
constexpr Microseconds kNoticeAfter{1'000'000};
constexpr Microseconds kLongestGap{1'000'000};
constexpr int kMostLines = 256;           // per step, so that a flood does not delay signals
constexpr std::size_t kFirstFrames = 16;  // enough to see the timing of four sensors
constexpr double kUsualRate_hz = 240;

double positive(const std::string& device, const std::string& key, const std::string& text) {
    const auto value = host::number_from<double>(text);
    if (!value || !std::isfinite(*value) || *value <= 0) {
        throw host::InputError(fmt::format("{}: {}={}: must be a positive number", device, key, text));
    }
    return *value;
}

void set_key(TextName& name, const std::string& device, const std::string& key, const std::string& value) {
    switch (host::index_of_name("key of " + device, key, {"mux", "rate_hz", "sigma", "sensors"})) {
        case 0:
            name.multiplexing = static_cast<signal::Multiplexing>(host::index_of_name(device + ": mux", value, {"tdm", "fdm"}));
            break;
        case 1:
            name.rate_hz = positive(device, key, value);
            break;
        case 2:
            name.sigma = positive(device, key, value);
            break;
        default:
            name.sensors = host::number_from<int>(value).value_or(0);
            if (name.sensors < 1 || name.sensors > tracking::kMaxSensors) {
                throw host::InputError(fmt::format("{}: sensors={}: must be 1 to {}", device, value, tracking::kMaxSensors));
            }
    }
}

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

TextName parse_text_name(const std::string& device) {
    TextName name;
    const std::size_t colon = device.find(':');
    const std::string rest = device.substr(colon + 1);
    const std::size_t comma = rest.find(',');
    name.where = rest.substr(0, comma);
    if (name.where.empty()) {
        throw host::InputError(fmt::format("device '{}': needs -, tcp:PORT, udp:PORT or a file", device));
    }
    for (std::size_t begin = comma; begin != std::string::npos;) {
        const std::size_t end = rest.find(',', begin + 1);
        const std::string part = rest.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
        const std::size_t equals = part.find('=');
        if (equals == std::string::npos) {
            throw host::InputError(fmt::format("device '{}': '{}' is not KEY=VALUE", device, part));
        }
        set_key(name, device.substr(0, colon), part.substr(0, equals), part.substr(equals + 1));
        begin = end;
    }
    return name;
}

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
    sides_[pose.sensor] = restorers_[pose.sensor].side(pose, drivers::host_now());
}

bool TextSource::advance(Microseconds patience) {
    const int most = is_lossy() ? kMostLines : 1;
    auto line = lines_.next(std::min(patience, kLongestStep));
    for (int n = 0; rests_ && line && is_live() && n < kMostLines; ++n) {
        line = lines_.next(Microseconds{0});
    }
    rests_ = false;
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
        begin(timing().value_or(Timing{name_.multiplexing.value_or(signal::Multiplexing::tdm), kUsualRate_hz}));
    }
    tick();
    return !lines_.has_ended();
}

/// During silence, poses are flagged stale.
void TextSource::tick() {
    const Microseconds silence = drivers::host_now() - arrival_;
    if (!is_live() || !newest_ || silence <= kSilence) {
        return;
    }
    if (silence > kNoticeAfter && !std::exchange(is_silent_, true)) {
        notice_.print("no column for 1 s");
    }
    for (int sensor = 0; sensor < name_.sensors; ++sensor) {
        trackers_.tick(static_cast<std::uint8_t>(sensor), *newest_ + silence);
    }
}

void TextSource::take(std::string_view line) {
    if (std::exchange(sender_, lines_.sender()) != lines_.sender()) {
        rows_.restart();
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
    if (const auto known = timing()) {
        begin(*known);
    } else if (first_frames_.size() == kFirstFrames) {
        first_frames_.clear();
        throw host::InputError("the times of the columns do not grow: give ,mux= and ,rate_hz=");
    }
}

/// From the times of the first frames of one sensor, unless the keys tell.
std::optional<TextSource::Timing> TextSource::timing() const {
    const TextFrame& first = first_frames_.front();
    std::optional<double> period_us;
    bool is_simultaneous = first.coils > 1;
    for (const TextFrame& next : first_frames_) {
        const bool is_of_sensor = next.sensor == first.sensor && next.time_us && first.time_us;
        const double later_us = is_of_sensor ? *next.time_us - *first.time_us : 0;
        if (is_of_sensor && next.first_coil == first.first_coil && later_us > 0 && !period_us) {
            period_us = later_us;
        }
        is_simultaneous = is_simultaneous || (is_of_sensor && next.first_coil != first.first_coil && later_us == 0);
    }
    if (!period_us && !(name_.rate_hz && (name_.multiplexing || first.coils > 1))) {
        return std::nullopt;
    }
    return Timing{name_.multiplexing.value_or(is_simultaneous ? signal::Multiplexing::fdm : signal::Multiplexing::tdm),
                  name_.rate_hz ? *name_.rate_hz : rate_of(*period_us)};
}

void TextSource::begin(const Timing& timing) {
    tracking::TrackerTap<double>::Settings settings;
    settings.sensors = name_.sensors;
    settings.calibration = params_.calibration;
    settings.tracker.method = params_.method;
    tracking::CommonParams<double>& common = settings.tracker.common;
    common.coupling_constant = params_.coupling_constant_m3;
    common.hemisphere = params_.hemisphere;
    common.confined = params_.session.confined;
    set_timing(timing.multiplexing, timing.rate_hz, settings);
    if (!first_frames_.front().has_quadrature) {
        common.quadrature_floor = 1;
        if (settings.calibration) {
            settings.calibration->quadrature_floor = 1;
        }
    }
    states_ = timing.multiplexing == signal::Multiplexing::tdm ? 1 : kSourceCoils;
    trackers_.begin(settings);
    has_begun_ = true;
    for (std::size_t sensor = 0; sensor < wanted_hemisphere_.size(); ++sensor) {
        if (wanted_hemisphere_[sensor]) {
            set_hemisphere(sensor, *wanted_hemisphere_[sensor]);
        }
    }
    for (const TextFrame& frame : std::exchange(first_frames_, {})) {
        track(frame);
    }
}

void TextSource::track(const TextFrame& frame) {
    const double frame_us = 1e6 * frames_[frame.sensor]++ / name_.rate_hz.value_or(kUsualRate_hz);
    MeasuredColumn<double> column;
    column.sensor = frame.sensor;
    column.midpoint = device_time_us(std::llround(frame.time_us.value_or(frame_us)));
    column.flags = frame.flags;
    column.sigma = frame.sigma.value_or(Vec3<double>::Constant(name_.sigma.value_or(0)));
    follow_clock(column.midpoint);
    for (int n = 0; n < frame.coils; ++n) {
        column.state = single_coil(frame.first_coil + n);
        column.in_phase = frame.in_phase[static_cast<std::size_t>(n)];
        column.quadrature = frame.quadrature[static_cast<std::size_t>(n)];
        column.sequence = columns_;
        column.state_sequence = columns_ / states_;
        ++columns_;
        ++counters_.columns;
        trackers_.column(column);
        if (const auto side = poses_.take_side(frame.sensor); side && is_live()) {  // a file has no other clock than its own
            ++counters_.hemispheres_restored;
            trackers_.hemisphere(frame.sensor, *side);
        }
    }
}

/// Times of several sensors may go back by a little.
void TextSource::follow_clock(DeviceTime now) {
    const Microseconds step = now - newest_.value_or(now);
    elapsed_ += step.count() > 0 && step < kLongestGap ? step : Microseconds{};
    newest_ = step.count() > 0 || step < -kLongestGap || !newest_ ? now : *newest_;
    arrival_ = drivers::host_now();
    is_silent_ = false;
}

bool TextSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    if (sensor >= static_cast<std::size_t>(name_.sensors)) {
        return false;
    }
    if (has_begun_) {
        trackers_.hemisphere(static_cast<std::uint8_t>(sensor), towards);
    } else {
        wanted_hemisphere_[sensor] = towards;
    }
    return true;
}

bool TextSource::is_steady() const { return newest_ && (!is_live() || drivers::host_now() - arrival_ <= kSilence); }

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
