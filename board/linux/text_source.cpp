#include "board/linux/text_source.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "board/linux/column_timing.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kSilence{150'000};  // longest time without a column before poses are flagged stale
constexpr Microseconds kLongestGap{1'000'000};
constexpr int kMostLines = 256;  // per step, so that a flood does not delay signals

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

/// Numbers of a JSON value by name: of the value, or with indices from 1 of a list, or of a list of lists.
template <typename Row>
void put_numbers(const std::string& name, const nlohmann::json& value, Row& row) {
    if (value.is_number()) {
        row[name] = value.template get<double>();
    } else if (value.is_array() && value.size() == 3) {
        const bool is_matrix = value[0].is_array();
        for (std::size_t n = 0; n < 3; ++n) {
            put_numbers(name + (is_matrix || name.size() == 2 ? "" : "_") + std::to_string(n + 1), value[n], row);
        }
    }
}

/// The numbers prefix + suffix, e.g. x11; nullopt if one is missing.
template <typename Row>
std::optional<Vec3<double>> vector_of(const Row& row, const std::string& prefix, const std::string& suffix = "") {
    Vec3<double> v;
    for (int n = 0; n < 3; ++n) {
        const auto found = row.find(prefix + std::to_string(n + 1) + suffix);
        if (found == row.end()) {
            return std::nullopt;
        }
        v(n) = found->second;
    }
    return v;
}

template <typename Row>
std::optional<double> number_of(const Row& row, std::string_view name) {
    const auto found = row.find(name);
    return found == row.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

TextName parse_text_name(const std::string& device) {
    TextName name;
    const std::size_t colon = device.find(':');
    const std::string rest = device.substr(colon + 1);
    const std::size_t comma = rest.find(',');
    name.multiplexing = device.starts_with("couplings") ? signal::Multiplexing::fdm : signal::Multiplexing::tdm;
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
      taps_{&counter_, &tap},
      trackers_(taps_),
      lines_(device_.substr(0, device_.find(':') + 1) + name_.where, name_.where),
      notice_(device_) {
    if (params_.session.dual_band) {
        throw host::InputError(device_ + ": columns of one band; use --tracker direct, previous or scaat");
    }
}

/// Trackers begin with the first line, which tells whether there are quadratures.
void TextSource::begin(bool has_quadrature) {
    tracking::TrackerTap<double>::Settings settings;
    settings.sensors = name_.sensors;
    settings.calibration = params_.calibration;
    settings.tracker.method = params_.method;
    tracking::CommonParams<double>& common = settings.tracker.common;
    common.coupling_constant = params_.coupling_constant_m3;
    common.hemisphere = params_.hemisphere;
    common.confined = params_.session.confined;
    set_timing(name_.multiplexing, name_.rate_hz.value_or(240), settings);
    if (!has_quadrature) {
        common.quadrature_floor = 1;
        if (settings.calibration) {
            settings.calibration->quadrature_floor = 1;
        }
    }
    trackers_.begin(settings);
    has_begun_ = true;
}

bool TextSource::advance(Microseconds patience) {
    auto line = lines_.next(std::min(patience, kLongestStep));
    for (int n = 0; line && n < kMostLines; ++n) {
        ++counters_.lines;
        try {
            take(*line);
        } catch (const host::InputError& error) {
            ++counters_.refused_lines;
            if (!is_live()) {
                throw;
            }
            notice_.print(error.what());
        }
        line = is_live() && n + 1 < kMostLines ? lines_.next(Microseconds{0}) : std::nullopt;
    }
    if (const HostTime now = drivers::host_now(); is_live() && newest_ && now - arrival_ > kSilence) {
        for (int sensor = 0; sensor < name_.sensors; ++sensor) {
            trackers_.tick(static_cast<std::uint8_t>(sensor), *newest_ + (now - arrival_));
        }
    }
    return !lines_.has_ended();
}

void TextSource::take(std::string_view line) {
    try {
        if (const auto row = row_of(line)) {
            take_row(*row);
        }
    } catch (const host::InputError& error) {
        throw host::InputError(fmt::format("{}{}: {}", is_live() ? "line " : name_.where + ":", lines_.line(), error.what()));
    }
}

/// Nullopt for a line without numbers: empty, a comment, the names of CSV, or another kind of line of a recording.
std::optional<TextSource::Row> TextSource::row_of(std::string_view line) {
    if (line.find_first_not_of(" \t,") == std::string_view::npos || line.front() == '#') {
        return std::nullopt;
    }
    Row row;
    if (line.front() == '{') {
        const auto object = nlohmann::json::parse(line, nullptr, false);
        if (!object.is_object()) {
            throw host::InputError("is not a JSON object");
        }
        for (const auto& [name, value] : object.items()) {
            put_numbers(name, value, row);
        }
        return row;
    }
    const auto fields = host::split(line, ',');
    if (names_.empty()) {
        names_.assign(fields.begin(), fields.end());
        return std::nullopt;
    }
    if (fields.size() != names_.size()) {
        throw host::InputError(fmt::format("has {} fields instead of {}", fields.size(), names_.size()));
    }
    for (std::size_t n = 0; n < fields.size(); ++n) {
        if (names_[n] == "kind" && fields[n] != "column") {
            return std::nullopt;
        }
        if (const auto value = host::number_from<double>(fields[n])) {
            row[names_[n]] = *value;
        } else if (!fields[n].empty() && names_[n] != "kind") {
            throw host::InputError(fmt::format("{}, '{}', is not a number", names_[n], fields[n]));
        }
    }
    return row;
}

void TextSource::take_row(const Row& row) {
    MeasuredColumn<double> column;
    const double sensor = number_of(row, "sensor").value_or(0);
    if (!(sensor >= 0 && sensor < name_.sensors) || sensor != std::floor(sensor)) {
        throw host::InputError(fmt::format("sensor {}: must be a number below {}; add ,sensors=N", sensor, name_.sensors));
    }
    column.sensor = static_cast<std::uint8_t>(sensor);
    const auto time_us = number_of(row, "time_us");
    const auto time_s = number_of(row, "time_s");
    const bool has_matrix = row.contains("x11");
    if (!time_us && !time_s && !(has_matrix && name_.rate_hz)) {
        throw host::InputError("no time: needs time_us or time_s, or couplings x11 to x33 with the key ,rate_hz=R");
    }
    const double time = time_us ? *time_us : 1e6 * (time_s ? *time_s : sequence_ / kSourceCoils / *name_.rate_hz);
    if (!(std::abs(time) < 9e15)) {
        throw host::InputError(fmt::format("time {} us: out of range", time));
    }
    column.midpoint = device_time_us(std::llround(time));
    const auto one_sigma = number_of(row, "sigma");
    const auto sigma = vector_of(row, "sigma_");
    if (!sigma && !one_sigma && !name_.sigma) {
        throw host::InputError("no sigma: add ,sigma=S to the name of the source, the standard deviation of a coupling");
    }
    column.sigma = sigma.value_or(Vec3<double>::Constant(one_sigma ? *one_sigma : name_.sigma.value_or(0)));
    const auto take_state = [&](int coil, const std::optional<Vec3<double>>& in_phase,
                                const std::optional<Vec3<double>>& quadrature) {
        if (!in_phase) {
            throw host::InputError("no couplings: needs state and in_phase_1 to in_phase_3, or x11 to x33");
        }
        if (!has_begun_) {
            begin(quadrature.has_value());
        }
        column.state = single_coil(coil);
        column.in_phase = *in_phase;
        column.quadrature = quadrature.value_or(Vec3<double>::Zero());
        take_column(column);
    };
    if (has_matrix) {
        for (int coil = 0; coil < kSourceCoils; ++coil) {
            const std::string suffix = std::to_string(coil + 1);
            take_state(coil, vector_of(row, "x", suffix), vector_of(row, "q", suffix));
        }
        return;
    }
    const double state = number_of(row, "state").value_or(0);
    if (state != 1 && state != 2 && state != 3) {
        throw host::InputError("no couplings: needs state (1 to 3) and in_phase_1 to in_phase_3, or x11 to x33");
    }
    take_state(static_cast<int>(state) - 1, vector_of(row, "in_phase_"), vector_of(row, "quadrature_"));
}

void TextSource::take_column(MeasuredColumn<double>& column) {
    if (!column.in_phase.allFinite() || !column.quadrature.allFinite() || !column.sigma.allFinite() ||
        !(column.sigma.minCoeff() > 0)) {
        throw host::InputError("couplings and sigma must be finite, and sigma positive");
    }
    column.sequence = sequence_;
    column.state_sequence = name_.multiplexing == signal::Multiplexing::tdm ? sequence_ : sequence_ / kSourceCoils;
    ++sequence_;
    ++counters_.columns;
    follow_clock(column.midpoint);
    trackers_.column(column);
}

void TextSource::follow_clock(DeviceTime now) {
    const Microseconds step = now - newest_.value_or(now);
    elapsed_ += step.count() > 0 && step < kLongestGap ? step : Microseconds{};
    newest_ = now;
    arrival_ = drivers::host_now();
}

bool TextSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    if (!has_begun_ || sensor >= static_cast<std::size_t>(name_.sensors)) {
        return false;
    }
    trackers_.hemisphere(static_cast<std::uint8_t>(sensor), towards);
    return true;
}

std::optional<host::LinkState> TextSource::link_state() const {
    const HostTime now = drivers::host_now();
    host::HealthCounts counts;
    counts.received = counters_.columns;
    counts.refused = counters_.refused_lines;
    counts.age = is_live() && newest_ ? now - arrival_ : Microseconds{};
    return host::LinkState{counts, now - HostTime{}};
}

std::string TextSource::status() const {
    return lines_.has_ended() ? "the lines have ended" : has_begun_ ? "running" : "waiting for the first line";
}

}  // namespace tricoil::linux_board
