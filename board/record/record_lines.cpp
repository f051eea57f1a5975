#include "board/record/record_lines.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"
#include "core/base/angle_units.hpp"
#include "core/signal/gain_step.hpp"
#include "core/tracking/judge/signal_flags.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kInputFields = 20;
constexpr std::size_t kPoseFields = 47;
constexpr std::size_t kEventFields = 4;
constexpr std::string_view kTruth = ",truth,";

/// Reads the fields of one line in order.
class Fields {
public:
    Fields(std::string_view line, std::size_t count, const std::string& where, char separator = ',')
        : where_(where), fields_(split(line, separator)) {
        refuse_if(fields_.size() != count, "{}: has {} fields instead of {}", where, fields_.size(), count);
    }

    std::string_view text() { return fields_[at_++]; }

    template <typename T>
    T number() {
        const std::string_view field = text();
        if (const auto value = number_from<T>(field)) {
            return *value;
        }
        throw InputError(fmt::format("{}: field {}, '{}', is not a valid number", where_, at_, field));
    }

    template <typename T>
    T number_below(T limit) {
        const T value = number<T>();
        refuse_if(value >= limit, "{}: field {} must be less than {}", where_, at_, limit);
        return value;
    }

    template <typename FlagEnum>
    FlagSet<FlagEnum> flags(FlagSet<FlagEnum> known) {
        const auto bits = number<std::uint32_t>();
        refuse_if((bits & ~known.bits()) != 0, "{}: field {}, '{}', has unknown flags", where_, at_, bits);
        return FlagSet<FlagEnum>::of_bits(bits, known);
    }

    /// An empty field: not a number.
    double number_or_none() {
        if (fields_[at_].empty()) {
            ++at_;
            return std::numeric_limits<double>::quiet_NaN();
        }
        return number<double>();
    }

    Vec3<double> vector() {
        Vec3<double> v;
        for (double& x : v) {
            x = number<double>();
        }
        return v;
    }

    void skip(std::size_t count) { at_ += count; }

private:
    const std::string& where_;
    std::vector<std::string_view> fields_;
    std::size_t at_ = 0;
};

std::string text_of(const Vec3<double>& v) { return fmt::format("{},{},{}", v.x(), v.y(), v.z()); }

}  // namespace

bool has_couplings(const TrackerInput& input) {
    return input.kind == InputKind::column && input.sensor == 0 && coil_index(input.column.state) >= 0 &&
           !tracking::signal_flags(input.column.flags).has_any(tracking::kFaultFlags);
}

std::string line_of(const TrackerInput& input) {
    const char* kind = kInputKinds[static_cast<std::size_t>(input.kind)];
    switch (input.kind) {
        case InputKind::column: {
            const MeasuredColumn<double>& c = input.column;
            return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}", kind, c.sensor, to_us(c.midpoint),
                               static_cast<int>(c.state), c.state_sequence, c.sequence, c.flags.bits(), text_of(c.in_phase),
                               text_of(c.quadrature), text_of(c.sigma), c.gain_step, fmt::join(c.level, ","));
        }
        case InputKind::tick:
            return fmt::format("{},{},{},,,,,,,,,,,,,,,,,", kind, input.sensor, to_us(input.now));
        case InputKind::hemisphere:
            return fmt::format("{},{},,,,,,{},,,,,,,,,,", kind, input.sensor, text_of(input.hemisphere));
        case InputKind::begin:
            break;
    }
    return fmt::format("{},,,,,,,,,,,,,,,,,,,", kind);
}

const std::array<std::string, 3>& record_headers() {
    static const std::array<std::string, 3> headers{
        "kind,sensor,time_us,state,state_sequence,sequence,flags,in_phase_1,in_phase_2,in_phase_3,quadrature_1,quadrature_2,"
        "quadrature_3,sigma_1,sigma_2,sigma_3,gain_step,level_1,level_2,level_3",
        pose_column_names(kRecordedForm), "time_us,sensor,event,detail"};
    return headers;
}

std::string_view old_input_header() {
    static constexpr std::string_view kAdded = ",gain_step,level_1,level_2,level_3";
    const std::string_view header = record_headers()[static_cast<std::size_t>(RecordFile::inputs)];
    return header.substr(0, header.size() - kAdded.size());
}

std::string line_of(const tracking::PoseEstimate<double>& e) {
    std::array<char, kLongestPoseText> text;
    return {text.data(), put_csv({e}, kRecordedForm, {}, text)};
}

std::string line_of(const TrueSensor& truth) {
    const auto& [p, q] = truth.pose;
    return fmt::format("{},{}{}{} {} {} {} {} {} {}", to_us(truth.time), truth.sensor, kTruth, p.x(), p.y(), p.z(), q.w(), q.x(),
                       q.y(), q.z());
}

TrackerInput parse_input(std::string_view line, const std::string& where) {
    Fields fields(line, kInputFields, where);
    TrackerInput input;
    const std::string_view kind = fields.text();
    const auto* const found = std::find(kInputKinds.begin(), kInputKinds.end(), kind);
    if (found == kInputKinds.end()) {
        throw InputError(fmt::format("{}: unknown input kind '{}'", where, kind));
    }
    input.kind = static_cast<InputKind>(found - kInputKinds.begin());
    if (input.kind == InputKind::begin) {
        return input;
    }
    input.sensor = fields.number<std::uint8_t>();
    switch (input.kind) {
        case InputKind::column: {
            MeasuredColumn<double>& c = input.column;
            c.sensor = input.sensor;
            c.midpoint = device_time_us(fields.number<std::int64_t>());
            c.state = static_cast<Excitation>(fields.number_below<std::uint8_t>(static_cast<int>(Excitation::all) + 1));
            c.state_sequence = fields.number<std::uint32_t>();
            c.sequence = fields.number<std::uint32_t>();
            c.flags = fields.flags(kAllColumnFlags);
            c.in_phase = fields.vector();
            c.quadrature = fields.vector();
            c.sigma = fields.vector();
            c.gain_step = fields.number_below<std::uint8_t>(static_cast<int>(signal::kMaxGainSteps));
            for (std::uint16_t& level : c.level) {
                level = fields.number<std::uint16_t>();
            }
            break;
        }
        case InputKind::tick:
            input.now = device_time_us(fields.number<std::int64_t>());
            break;
        default:
            fields.skip(5);
            input.hemisphere = fields.vector();
    }
    return input;
}

tracking::PoseEstimate<double> parse_pose(std::string_view line, const std::string& where) {
    Fields fields(line, kPoseFields, where);
    tracking::PoseEstimate<double> e;
    e.sensor = fields.number_below<std::uint8_t>(tracking::kMaxSensors);
    e.sequence = fields.number<std::uint32_t>();
    e.time = device_time_us(fields.number<std::int64_t>());
    fields.skip(1);  // valid: derived from the flags
    e.flags = fields.flags(tracking::kAllPoseFlags);
    e.state = static_cast<tracking::TrackerState>(fields.number_below<std::uint8_t>(3));
    for (double& x : e.position_m) {
        x = fields.number_or_none();
    }
    e.q_source_sensor.w() = fields.number<double>();
    e.q_source_sensor.vec() = fields.vector();
    refuse_if(!std::isfinite(e.q_source_sensor.norm()), "{}: the attitude is not a number", where);
    for (int i = 0; i < 6; ++i) {
        for (int j = i; j < 6; ++j) {
            e.covariance(i, j) = e.covariance(j, i) = fields.number_or_none();
        }
    }
    e.distortion_m = 1e-3 * fields.number_or_none();
    e.snr_db = fields.number_or_none();
    tracking::clear_unknown_position(e);
    if (const std::string_view position_mm = fields.text(); !position_mm.empty()) {
        const double position = number_from<double>(position_mm).value_or(0);
        e.predicted_error.emplace();
        e.predicted_error->total = {1e-3 * position, kRadians * fields.number<double>()};
    } else {
        fields.skip(1);
    }
    for (double& x : e.signal_matrix.reshaped()) {
        x = fields.number<double>();
    }
    return e;
}

std::optional<TrueSensor> parse_truth(std::string_view line, const std::string& where) {
    constexpr std::size_t kNumbers = 7;
    constexpr double kUnitTolerance = 1e-3;
    if (line.find(kTruth) == std::string_view::npos) {  // the other events are for people
        return std::nullopt;
    }
    Fields fields(line, kEventFields, where);
    TrueSensor truth;
    truth.time = device_time_us(fields.number<std::int64_t>());
    truth.sensor = fields.number_below<std::uint8_t>(tracking::kMaxSensors);
    fields.skip(1);
    Fields numbers(fields.text(), kNumbers, where, ' ');
    truth.pose.position_m = numbers.vector();
    truth.pose.q_source_sensor.w() = numbers.number<double>();
    truth.pose.q_source_sensor.vec() = numbers.vector();
    const bool is_pose = truth.pose.position_m.allFinite() && std::abs(truth.pose.q_source_sensor.norm() - 1) < kUnitTolerance;
    refuse_if(!is_pose, "{}: the true position is not finite, or its quaternion is not a rotation", where);
    return truth;
}

}  // namespace tricoil::host
