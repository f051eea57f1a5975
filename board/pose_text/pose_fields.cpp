#include "board/pose_text/pose_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "board/pose_text/flag_names.hpp"
#include "core/base/angle_units.hpp"
#include "core/base/assertion.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::host {
namespace {

using Pose = tracking::PoseEstimate<double>;
using Row = PoseRow;
using Units = PoseUnits;

/// False if a pose has no position: then the field is empty.
bool put(const Vec3<double>& v, double* out, double unit = 1) {
    const Vec3<double> scaled = unit * v;
    std::copy_n(scaled.data(), 3, out);
    return v.allFinite();
}

bool put(double value, double* out) {
    *out = value;
    return std::isfinite(value);
}

bool put(const Quat<double>& q, double* out) {
    for (const double part : {q.w(), q.x(), q.y(), q.z()}) {
        *out++ = part;
    }
    return true;
}

bool put_deviation(const Row& row, const Units& units, double* out) {
    for (Index i = 0; i < 6; ++i) {
        *out++ = (i < 3 ? units.units_per_m : 1) * std::sqrt(row.pose.covariance(i, i));
    }
    return std::isfinite(row.pose.covariance.trace());
}

bool put_covariance(const Row& row, const Units& units, double* out) {
    for (Index i = 0; i < 6; ++i) {
        for (Index j = i; j < 6; ++j) {
            *out++ = (i < 3 ? units.units_per_m : 1) * (j < 3 ? units.units_per_m : 1) * row.pose.covariance(i, j);
        }
    }
    return std::isfinite(row.pose.covariance.trace());
}

const std::array<PoseField, static_cast<std::size_t>(PoseFieldId::kCount)> kFields{{
    {"sensor", "sensor", 1, [](const Pose& p) -> std::int64_t { return p.sensor; }},
    {"sequence", "sequence", 1, [](const Pose& p) -> std::int64_t { return p.sequence; }},
    {"time_us", "time_us", 1, [](const Pose& p) -> std::int64_t { return to_us(p.time); }},
    {"valid", "valid", 1, [](const Pose& p) -> std::int64_t { return p.valid() ? 1 : 0; }},
    {"flags", "flags", 1, [](const Pose& p) -> std::int64_t { return p.flags.bits(); }},
    {"state", "state", 1, [](const Pose& p) { return static_cast<std::int64_t>(p.state); }},
    {"position_{u}", "x_{u},y_{u},z_{u}", 3, nullptr,
     [](const Row& r, const Units& u, double* out) { return put(r.pose.position_m, out, u.units_per_m); }},
    {"q_wxyz", "qw,qx,qy,qz", 4, nullptr,
     [](const Row& r, const Units&, double* out) { return put(r.pose.q_source_sensor, out); }},
    {"std_{u}_rad", "std_x_{u},std_y_{u},std_z_{u},std_rx_rad,std_ry_rad,std_rz_rad", 6, nullptr, put_deviation},
    {"covariance",
     "cov_xx,cov_xy,cov_xz,cov_xrx,cov_xry,cov_xrz,cov_yy,cov_yz,cov_yrx,cov_yry,cov_yrz,cov_zz,cov_zrx,cov_zry,cov_zrz,"
     "cov_rxrx,cov_rxry,cov_rxrz,cov_ryry,cov_ryrz,cov_rzrz",
     21, nullptr, put_covariance},
    {"distortion_mm", "distortion_mm", 1, nullptr,
     [](const Row& r, const Units&, double* out) { return put(1e3 * r.pose.distortion_m, out); }},
    {"snr_db", "snr_db", 1, nullptr, [](const Row& r, const Units&, double* out) { return put(r.pose.snr_db, out); }},
    {"flag_names", "flag_names", 0},
    {"predicted_error_mm", "predicted_error_mm", 1, nullptr,
     [](const Row& r, const Units&, double* out) {
         return r.pose.predicted_error && (*out = 1e3 * r.pose.predicted_error->total.position_m, true);
     }},
    {"predicted_error_deg", "predicted_error_deg", 1, nullptr,
     [](const Row& r, const Units&, double* out) {
         return r.pose.predicted_error && (*out = kDegrees * r.pose.predicted_error->total.rotation_rad, true);
     }},
    {"couplings", "x11,x21,x31,x12,x22,x32,x13,x23,x33", 9, nullptr,
     [](const Row& r, const Units&, double* out) { return std::copy_n(r.pose.signal_matrix.data(), 9, out), true; }},
    {"true_position_{u}", "true_x_{u},true_y_{u},true_z_{u}", 3, nullptr,
     [](const Row& r, const Units& u, double* out) {
         return r.truth != nullptr && put(r.truth->position_m, out, u.units_per_m);
     }},
    {"true_q_wxyz", "true_qw,true_qx,true_qy,true_qz", 4, nullptr,
     [](const Row& r, const Units&, double* out) { return r.truth != nullptr && put(r.truth->q_source_sensor, out); }},
    {"error_position_m", "error_position_m", 1, nullptr,
     [](const Row& r, const Units&, double* out) {
         return r.truth != nullptr && put((r.pose.position_m - r.truth->position_m).norm(), out);
     }},
    {"error_orientation_rad", "error_orientation_rad", 1, nullptr,
     [](const Row& r, const Units&, double* out) {
         return r.truth != nullptr && (*out = geometry::angle_between(r.pose.q_source_sensor, r.truth->q_source_sensor), true);
     }},
    {"euler_{e}_deg", "euler_{e}_1_deg,euler_{e}_2_deg,euler_{e}_3_deg", 3, nullptr,
     [](const Row& r, const Units& u, double* out) {
         return u.euler && put(geometry::euler_angles<double>(r.pose.q_source_sensor, *u.euler), out, kDegrees);
     }},
    {"velocity_{u}_s", "vx_{u}_s,vy_{u}_s,vz_{u}_s", 3, nullptr,
     [](const Row& r, const Units& u, double* out) {
         return r.velocity_m_s != nullptr && put(*r.velocity_m_s, out, u.units_per_m);
     }},
    {"rate_rad_s", "wx_rad_s,wy_rad_s,wz_rad_s", 3, nullptr,
     [](const Row& r, const Units&, double* out) { return r.rate_rad_s != nullptr && put(*r.rate_rad_s, out); }},
    {"utc_s", "utc_s", 1, nullptr,
     [](const Row& r, const Units&, double* out) { return r.utc && (*out = static_cast<double>(to_us(*r.utc)) / 1e6, true); }},
    {"expected_error_mm", "expected_error_mm", 1, nullptr,
     [](const Row& r, const Units&, double* out) { return put(1e3 * r.expected_error_m, out); }},
    {"epoch", "epoch", 1, nullptr, [](const Row& r, const Units&, double* out) { return r.epoch && (*out = *r.epoch, true); }},
}};

/// Appends to a buffer that must be large enough.
class Text {
public:
    explicit Text(std::span<char> out) : out_(out) {}

    template <typename... Values>
    void print(fmt::format_string<Values...> format, Values&&... values) {
        const auto free = out_.subspan(size_);
        const std::size_t size = fmt::format_to_n(free.data(), free.size(), format, std::forward<Values>(values)...).size;
        TRICOIL_ASSERT(size <= free.size());
        size_ += size;
    }
    /// `text` with the unit and the order of axes in place.
    void put_name(std::string_view text, const Units& units) {
        for (std::size_t at = text.find('{'); at != std::string_view::npos; at = text.find('{')) {
            print("{}{}", text.substr(0, at), text[at + 1] == 'u' ? units.unit : units.euler_name);
            text.remove_prefix(at + 3);
        }
        print("{}", text);
    }
    void put_flag_names(std::uint32_t flags) {
        bool is_first = true;
        const auto names = flag_names();
        for (std::size_t bit = 0; bit < names.size(); ++bit) {
            if ((flags >> bit & 1U) != 0) {
                print("{}{}", is_first ? "" : " ", names[bit]);
                is_first = false;
            }
        }
    }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    std::span<char> out_;
    std::size_t size_ = 0;
};

std::string with_units(const char* text, const Units& units) {
    std::array<char, 256> buffer{};
    Text name(buffer);
    name.put_name(text, units);
    return {buffer.data(), name.size()};
}

}  // namespace

const PoseField& pose_field(PoseFieldId id) { return kFields.at(static_cast<std::size_t>(id)); }

std::string pose_column_names(PoseForm form, const PoseUnits& units) {
    std::string names;
    for_each_field(form, units, [&](const PoseField& field) {
        names.append(names.empty() ? "" : ",").append(with_units(field.columns, units));
    });
    return names;
}

std::size_t put_csv(const PoseRow& row, PoseForm form, const PoseUnits& units, std::span<char> out) {
    Text text(out);
    for_each_field(form, units, [&](const PoseField& field) {
        text.print("{}", text.size() == 0 ? "" : ",");
        std::array<double, PoseField::kMostNumbers> numbers{};
        if (field.integer != nullptr) {
            text.print("{}", field.integer(row.pose));
        } else if (field.is_names()) {
            text.put_flag_names(row.pose.flags.bits());
        } else if (field.numbers(row, units, numbers.data())) {
            text.print("{}", fmt::join(numbers.begin(), numbers.begin() + field.count, ","));
        } else {
            text.print("{:,<{}}", "", field.count - 1);
        }
    });
    return text.size();
}

std::size_t put_json(const PoseRow& row, PoseForm form, const PoseUnits& units, std::span<char> out) {
    Text text(out);
    for_each_field(form, units, [&](const PoseField& field) {
        text.print("{}\"", text.size() == 0 ? "{" : ",");
        text.put_name(field.key, units);
        text.print("\":");
        std::array<double, PoseField::kMostNumbers> numbers{};
        if (field.integer != nullptr) {
            text.print("{}", field.integer(row.pose));
        } else if (field.is_names()) {
            text.print("\"");
            text.put_flag_names(row.pose.flags.bits());
            text.print("\"");
        } else if (!field.numbers(row, units, numbers.data())) {
            text.print("null");
        } else {
            text.print("{}", field.count > 1 ? "[" : "");
            for (std::size_t i = 0; i < field.count; ++i) {
                text.print("{}", i == 0 ? "" : ",");
                std::isfinite(numbers[i]) ? text.print("{}", numbers[i]) : text.print("null");
            }
            text.print("{}", field.count > 1 ? "]" : "");
        }
    });
    text.print("}}");
    return text.size();
}

std::string pose_line(const PoseRow& row, PoseFormat format, PoseForm form, const PoseUnits& units) {
    std::array<char, kLongestPoseText> text;  // not set to zero: this is called for every pose
    const std::size_t size = format == PoseFormat::csv ? put_csv(row, form, units, text) : put_json(row, form, units, text);
    return std::string(text.data(), size) + '\n';
}

}  // namespace tricoil::host
