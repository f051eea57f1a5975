#include "board/linux/text_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::linux_board {

void check_time(double time_us) { host::refuse_if(!(std::abs(time_us) < kLatestTime_us), "time {} us: out of range", time_us); }

namespace {

constexpr std::array<std::string_view, 33> kNames{
    "time_us",      "time_s",       "sensor",       "state",   "flags",   "sigma",   "in_phase_1", "in_phase_2", "in_phase_3",
    "quadrature_1", "quadrature_2", "quadrature_3", "sigma_1", "sigma_2", "sigma_3", "x11",        "x21",        "x31",
    "x12",          "x22",          "x32",          "x13",     "x23",     "x33",     "q11",        "q21",        "q31",
    "q12",          "q22",          "q32",          "q13",     "q23",     "q33"};
enum Name { kTimeUs, kTimeS, kSensor, kState, kFlags, kSigma, kInPhase, kQuadrature = 9, kSigmas = 12, kX = 15, kQ = 24 };
constexpr int kKind = static_cast<int>(kNames.size());
using Row = std::array<std::optional<double>, kNames.size()>;

/// Index in kNames, kKind, or -1.
int index_of(std::string_view name) {
    const auto found = std::find(kNames.begin(), kNames.end(), name);
    return found != kNames.end() ? static_cast<int>(found - kNames.begin()) : name == "kind" ? kKind : -1;
}

std::string shortened(std::string_view text) { return std::string(text.substr(0, 40)); }

/// Three numbers from index `first` on, if all are there.
std::optional<Vec3<double>> three(const Row& row, int first) {
    const auto at = [&](int n) { return row[static_cast<std::size_t>(first + n)]; };
    return at(0) && at(1) && at(2) ? std::optional(Vec3<double>(*at(0), *at(1), *at(2))) : std::nullopt;
}

void put(const nlohmann::json& value, std::string_view name, int index, Row& row) {
    if (value.is_number()) {
        row[static_cast<std::size_t>(index)] = value.get<double>();
    } else if (!value.is_null()) {
        throw host::InputError(fmt::format("{}: is not a number", name));
    }
}

/// A list of three values.
const nlohmann::json& list_of(const nlohmann::json& value, std::string_view name) {
    host::refuse_if(!value.is_array() || value.size() != 3, "{}: is not a list of three", name);
    return value;
}

Row row_of_json(std::string_view line) {
    const auto object = nlohmann::json::parse(line, nullptr, false);
    host::refuse_if(!object.is_object(), "is not a JSON object");
    Row row;
    for (const auto& item : object.items()) {
        const std::string& name = item.key();
        const nlohmann::json& value = item.value();
        const int index = index_of(name);
        const auto is_named = [&](const char* list) { return name == list && !value.is_null(); };
        if (is_named("in_phase") || is_named("quadrature") || (is_named("sigma") && value.is_array())) {
            const int first = name == "in_phase" ? kInPhase : name == "quadrature" ? kQuadrature : kSigmas;
            for (int n = 0; n < 3; ++n) {
                put(list_of(value, name)[static_cast<std::size_t>(n)], name, first + n, row);
            }
        } else if (is_named("x") || is_named("q")) {
            for (int n = 0; n < 9; ++n) {
                const auto& line_of_matrix = list_of(list_of(value, name)[static_cast<std::size_t>(n / 3)], name);
                put(line_of_matrix[static_cast<std::size_t>(n % 3)], name, (name == "x" ? kX : kQ) + 3 * (n % 3) + n / 3, row);
            }
        } else if (index >= 0 && index < kKind) {
            put(value, name, index, row);
        }
    }
    return row;
}

/// Nullopt for another kind of row.
std::optional<Row> row_of_csv(const std::vector<std::string_view>& fields, const std::vector<int>& columns) {
    host::refuse_if(fields.size() != columns.size(), "has {} fields instead of {}", fields.size(), columns.size());
    Row row;
    for (std::size_t n = 0; n < fields.size(); ++n) {
        if (columns[n] == kKind && fields[n] != "column") {
            return std::nullopt;
        }
        if (columns[n] < 0 || columns[n] == kKind || fields[n].empty()) {
            continue;
        }
        const auto value = host::cell_number(fields[n]);
        if (!value) {
            throw host::InputError(
                fmt::format("{}, '{}', is not a number", kNames[static_cast<std::size_t>(columns[n])], shortened(fields[n])));
        }
        row[static_cast<std::size_t>(columns[n])] = *value;
    }
    return row;
}

/// The whole number of a field, `least` to `most`.
int whole(const Row& row, Name name, int most, int least = 0) {
    const double value = row[name].value_or(least);
    host::refuse_if(!(value >= least && value <= most) || value != std::floor(value),
                    "{} {}: must be a whole number from {} to {}", kNames[name], value, least, most);
    return static_cast<int>(value);
}

void check(const TextFrame& frame) {
    bool is_finite = !frame.sigma || (frame.sigma->allFinite() && frame.sigma->minCoeff() > 0);
    for (int n = 0; n < frame.coils; ++n) {
        const auto coil = static_cast<std::size_t>(n);
        is_finite = is_finite && frame.in_phase[coil].allFinite() && frame.quadrature[coil].allFinite();
    }
    host::refuse_if(!is_finite, "couplings and sigma must be finite, and sigma positive");
    if (frame.time_us) {
        check_time(*frame.time_us);
    }
}

TextFrame frame_of(const Row& row) {
    TextFrame frame;
    frame.sensor = static_cast<std::uint8_t>(whole(row, kSensor, tracking::kMaxSensors - 1));
    frame.time_us = row[kTimeUs] ? row[kTimeUs] : row[kTimeS] ? std::optional(1e6 * *row[kTimeS]) : std::nullopt;
    const auto bits = static_cast<unsigned>(whole(row, kFlags, static_cast<int>(kAllColumnFlags.bits())));
    host::refuse_if((bits & ~kAllColumnFlags.bits()) != 0, "flags {}: has unknown flags", bits);
    frame.flags = ColumnFlags::of_bits(bits, kAllColumnFlags);
    frame.sigma = three(row, kSigmas);
    if (!frame.sigma && row[kSigma]) {
        frame.sigma = Vec3<double>::Constant(*row[kSigma]);
    }
    const bool is_matrix = row[kX].has_value();
    frame.coils = is_matrix ? kSourceCoils : 1;
    const bool has_state = row[kState].has_value();
    frame.first_coil = is_matrix || !has_state ? 0 : whole(row, kState, kSourceCoils, 1) - 1;
    for (int n = 0; n < frame.coils; ++n) {
        const auto coil = static_cast<std::size_t>(n);
        const auto in_phase = three(row, is_matrix ? kX + 3 * n : kInPhase);
        if (!in_phase || !(is_matrix || has_state)) {
            throw host::InputError("no couplings: needs state (1 to 3) and in_phase_1 to in_phase_3, or x11 to x33");
        }
        const auto quadrature = three(row, is_matrix ? kQ + 3 * n : kQuadrature);
        frame.has_quadrature = quadrature.has_value();
        frame.in_phase[coil] = *in_phase;
        frame.quadrature[coil] = quadrature.value_or(Vec3<double>::Zero());
    }
    check(frame);
    return frame;
}

}  // namespace

std::optional<TextFrame> TextRows::parse(std::string_view line) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (line.starts_with(kByteOrderMark)) {
        line.remove_prefix(kByteOrderMark.size());
    }
    const std::size_t begin = line.find_first_not_of(" \t\r,;\"");
    if (begin == std::string_view::npos || line[begin] == '#') {
        return std::nullopt;
    }
    if (line.front() == '{') {
        return frame_of(row_of_json(line));
    }
    separator_ = columns_.empty() ? host::separator_of(line) : separator_;
    std::vector<std::string_view> fields;
    host::split_cells(line, separator_, fields);
    if (std::any_of(fields.begin(), fields.end(), [](std::string_view field) { return index_of(field) >= 0; })) {
        columns_.resize(fields.size());
        std::transform(fields.begin(), fields.end(), columns_.begin(), index_of);
        for (const int column : columns_) {
            if (column >= 0 && std::count(columns_.begin(), columns_.end(), column) > 1) {
                columns_.clear();
                throw host::InputError(
                    fmt::format("more than one column {}", column < kKind ? kNames[static_cast<std::size_t>(column)] : "kind"));
            }
        }
        return std::nullopt;
    }
    if (columns_.empty()) {
        throw host::InputError(fmt::format("'{}': neither a JSON object nor names such as time_us,x11,x12", shortened(line)));
    }
    const auto row = row_of_csv(fields, columns_);
    return row ? std::optional(frame_of(*row)) : std::nullopt;
}

}  // namespace tricoil::linux_board
