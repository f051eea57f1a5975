#include "board/pose_text/pose_fields.hpp"

#include <fmt/format.h>

#include <cmath>

#include "board/pose_text/flag_names.hpp"
#include "core/base/assertion.hpp"
#include "core/protocol/convert.hpp"

namespace tricoil::host {
namespace {

using P = PoseNumbers;
using Numbers = std::span<const double>;

constexpr const char* kSignificant = "{:.8g}";  // the wire has 24 bits
constexpr double kLongFrom = 1e12;  // larger numbers are written with an exponent, so that a pose has a limited length

const std::array<PoseField, 12> kFields{{
    {"sensor", {"sensor"}, 0, "", &P::sensor},
    {"sequence", {"sequence"}, 0, "", &P::sequence},
    {"time_us", {"time_us"}, 0, "", &P::time_us},
    {"valid", {"valid"}, 0, "", &P::valid},
    {"flags", {"flags"}, 0, "", &P::flags},
    {"state", {"state"}, 0, "", &P::state},
    {"position_m", {"x", "y", "z"}, 3, "{:.7f}", nullptr, [](const P& p) { return Numbers(p.position); }},
    {"q_wxyz", {"qw", "qx", "qy", "qz"}, 0, "{:.9f}", nullptr, [](const P& p) { return Numbers(p.q_wxyz); }},
    {"std_m_rad",
     {"std_x", "std_y", "std_z", "std_rx_rad", "std_ry_rad", "std_rz_rad"},
     3,
     kSignificant,
     nullptr,
     [](const P& p) { return Numbers(p.deviation); }},
    {"distortion_mm", {"distortion_mm"}, 0, "{:.4f}", nullptr, [](const P& p) { return Numbers(&p.distortion_mm, 1); }},
    {"snr_db", {"snr_db"}, 0, "{:.2f}", nullptr, [](const P& p) { return Numbers(&p.snr_db, 1); }},
    {"flag_names", {"flag_names"}, 0, ""},
}};
constexpr std::size_t kDeviation = 8;

/// Appends to a buffer that must be large enough.
class Text {
public:
    explicit Text(std::span<char> out) : out_(out) {}

    template <typename... Values>
    void print(std::string_view format, const Values&... values) {
        const auto free = out_.subspan(size_);
        const std::size_t size = fmt::format_to_n(free.data(), free.size(), fmt::runtime(format), values...).size;
        TRICOIL_ASSERT(size <= free.size());
        size_ += size;
    }
    /// not_finite: text for NaN and infinity.
    void put_numbers(const PoseField& field, Numbers numbers, const char* not_finite) {
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            print(i == 0 ? "" : ",");
            const bool is_long = std::abs(numbers[i]) >= kLongFrom;
            print(!std::isfinite(numbers[i]) ? not_finite : is_long ? kSignificant : field.format, numbers[i]);
        }
    }
    void put_flag_names(std::int64_t flags) {
        bool is_first = true;
        const auto names = flag_names();
        for (std::size_t bit = 0; bit < names.size(); ++bit) {
            if ((flags >> bit & 1) != 0) {
                print(is_first ? "{}" : " {}", names[bit]);
                is_first = false;
            }
        }
    }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    std::span<char> out_;
    std::size_t size_ = 0;
};

}  // namespace

std::span<const PoseField> pose_fields() { return kFields; }

bool is_deviation(const PoseField& field) { return &field == &kFields[kDeviation]; }

PoseNumbers numbers_of(const protocol::PoseMessage& m) {
    PoseNumbers n{m.sensor,
                  m.sequence,
                  m.time_us,
                  (m.flags & tracking::kInvalidating.bits()) == 0 ? 1 : 0,
                  m.flags,
                  m.tracker_state,
                  {},
                  {},
                  {},
                  1e3 * m.distortion / protocol::kDistortionPerMetre,
                  1e-2 * m.snr_cdb};
    for (std::size_t i = 0; i < 3; ++i) {
        n.position[i] = m.position[i] / protocol::kPositionPerMetre;
    }
    for (std::size_t i = 0; i < 4; ++i) {
        n.q_wxyz[i] = m.quaternion[i] / protocol::kQuaternionPerUnit;
    }
    for (std::size_t i = 0; i < 6; ++i) {
        n.deviation[i] = m.deviation[i] / protocol::kDeviationPerUnit;
    }
    return n;
}

PoseNumbers numbers_of(const tracking::PoseEstimate<double>& e, double units_per_m) {
    const Quat<double>& q = e.q_source_sensor;
    PoseNumbers n{e.sensor,
                  e.sequence,
                  to_us(e.time),
                  e.valid() ? 1 : 0,
                  e.flags.bits(),
                  static_cast<std::int64_t>(e.state),
                  {},
                  {q.w(), q.x(), q.y(), q.z()},
                  {},
                  1e3 * e.distortion_m,
                  e.snr_db};
    for (std::size_t i = 0; i < 6; ++i) {
        const auto k = static_cast<Index>(i);
        const double unit = i < 3 ? units_per_m : 1;
        n.deviation[i] = unit * std::sqrt(e.covariance(k, k));
        if (i < 3) {
            n.position[i] = unit * e.position_m(k);
        }
    }
    return n;
}

std::string pose_column_names(std::string_view unit, std::string_view instead_of_deviation) {
    std::string names;
    for (const PoseField& field : kFields) {
        if (!instead_of_deviation.empty() && (is_deviation(field) || field.is_names())) {
            names.append(is_deviation(field) ? "," : "").append(is_deviation(field) ? instead_of_deviation : "");
            continue;
        }
        for (std::size_t i = 0; i < field.names.size() && field.names[i] != nullptr; ++i) {
            names.append(names.empty() ? "" : ",").append(field.names[i]);
            if (i < field.lengths) {
                names.append("_").append(unit);
            }
        }
    }
    return names;
}

std::size_t put_csv(const PoseNumbers& pose, std::span<char> out) {
    Text text(out);
    for (const PoseField& field : kFields) {
        text.print(text.size() == 0 ? "" : ",");
        if (field.integer != nullptr) {
            text.print("{}", pose.*field.integer);
        } else if (field.is_names()) {
            text.put_flag_names(pose.flags);
        } else {
            text.put_numbers(field, field.numbers(pose), "{}");
        }
    }
    return text.size();
}

std::size_t put_json(const PoseNumbers& pose, std::span<char> out) {
    Text text(out);
    for (const PoseField& field : kFields) {
        text.print(text.size() == 0 ? "{{\"{}\":" : ",\"{}\":", field.key);
        if (field.integer != nullptr) {
            text.print("{}", pose.*field.integer);
            continue;
        }
        if (field.is_names()) {
            text.print("\"");
            text.put_flag_names(pose.flags);
            text.print("\"");
            continue;
        }
        const Numbers numbers = field.numbers(pose);
        text.print(numbers.size() > 1 ? "[" : "");
        text.put_numbers(field, numbers, "null");
        text.print(numbers.size() > 1 ? "]" : "");
    }
    text.print("}}");
    return text.size();
}

}  // namespace tricoil::host
