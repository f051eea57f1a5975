#include "board/host/dynamic/dynamic_report.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/base/angle_units.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/cholesky.hpp"

namespace tricoil::host {
namespace {

constexpr std::array kSpeedEdges_m_s{0.0, 0.1, 0.25, 0.5, 1.0, 2.0, HUGE_VAL};

DynamicError error_of(const TimedPose& measured, const MovingPose& truth) {
    const Vec3<double> d = measured.position_m - truth.pose.position_m;
    DynamicError e;
    e.time_s = measured.time_s;
    e.speed_m_s = truth.velocity_m_s.norm();
    e.acceleration_m_s2 = truth.acceleration_m_s2.norm();
    e.position_m = d.norm();
    e.along_m = e.speed_m_s > 0 ? d.dot(truth.velocity_m_s) / e.speed_m_s : 0;
    e.orientation_rad = geometry::angle_between(measured.q, truth.pose.q);
    return e;
}

SpeedBand band_of(const std::vector<DynamicError>& errors, double from, double to) {
    SpeedBand band{from, to};
    double p = 0;
    double r = 0;
    for (const DynamicError& e : errors) {
        if (e.speed_m_s >= from && e.speed_m_s < to) {
            ++band.poses;
            p += e.position_m * e.position_m;
            r += e.orientation_rad * e.orientation_rad;
        }
    }
    const auto n = static_cast<double>(std::max<std::size_t>(band.poses, 1));
    band.position_rms_m = std::sqrt(p / n);
    band.orientation_rms_deg = kDegrees * std::sqrt(r / n);
    return band;
}

/// Non-negative least squares with three unknowns: tries all subsets of unknowns that are not zero.
Vec3<double> non_negative(const Mat3<double>& normal, const Vec3<double>& right) {
    Vec3<double> best = Vec3<double>::Zero();
    double lowest = 0;
    for (int subset = 1; subset < 8; ++subset) {
        Mat3<double> m = normal;
        Vec3<double> b = right;
        for (int i = 0; i < 3; ++i) {
            if ((subset >> i & 1) == 0) {
                m.row(i).setZero();
                m.col(i).setZero();
                m(i, i) = 1;
                b(i) = 0;
            }
        }
        const Cholesky<double, 3> factor(m);
        if (!factor.ok()) {
            continue;  // these unknowns depend on each other; a smaller subset fits as well
        }
        const Vec3<double> x = factor.solve(b);
        const double cost = x.dot(normal * x) - 2 * x.dot(right);
        if (x.allFinite() && x.minCoeff() >= 0 && cost < lowest) {
            lowest = cost;
            best = x;
        }
    }
    return best;
}

void fit_growth(DynamicReport& report) {
    Mat3<double> normal = Mat3<double>::Zero();
    Vec3<double> right = Vec3<double>::Zero();
    double along = 0;
    double weight = 0;
    for (const DynamicError& e : report.errors) {
        const Vec3<double> row(1, e.speed_m_s * e.speed_m_s, e.acceleration_m_s2 * e.acceleration_m_s2);
        normal += row * row.transpose();
        right += row * (e.position_m * e.position_m);
        along -= e.along_m * e.speed_m_s;
        weight += e.speed_m_s * e.speed_m_s;
    }
    const Vec3<double> scale = normal.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();  // for conditioning
    const Mat3<double> scaled = scale.asDiagonal() * normal * scale.asDiagonal();
    const Vec3<double> squares = scale.asDiagonal() * non_negative(scaled, scale.asDiagonal() * right);
    report.at_rest_m = std::sqrt(squares(0));
    report.per_speed_s = std::sqrt(squares(1));
    report.per_acceleration_s2 = std::sqrt(squares(2));
    const double fitted_s = weight > 0 ? along / weight : 0;
    report.lag_s = report.alignment.lag_s != 0 ? report.alignment.lag_s : fitted_s;
}

}  // namespace

DynamicReport dynamic_report(const PoseStream& tracker, const PoseStream& reference, const StreamAlignment& alignment) {
    DynamicReport report;
    report.alignment = alignment;
    std::vector<double> position;
    std::vector<double> orientation;
    for (const TimedPose& p : tracker.poses()) {
        const double t = p.time_s + alignment.time_offset_s;
        if (!reference.covers(t)) {
            report.in_gaps += t >= reference.begin_s() && t <= reference.end_s() ? 1U : 0U;
            continue;
        }
        report.errors.push_back(error_of(p, alignment.applied(reference, p.time_s)));
        position.push_back(report.errors.back().position_m);
        orientation.push_back(kDegrees * report.errors.back().orientation_rad);
    }
    report.position_m = summarise(position);
    report.orientation_deg = summarise(orientation);
    for (std::size_t n = 0; n + 1 < kSpeedEdges_m_s.size(); ++n) {
        report.bands.push_back(band_of(report.errors, kSpeedEdges_m_s[n], kSpeedEdges_m_s[n + 1]));
    }
    fit_growth(report);
    return report;
}

std::string dynamic_csv(const DynamicReport& report) {
    std::string text = "time_s,speed_m_s,acceleration_m_s2,position_error_mm,along_velocity_mm,orientation_error_deg\n";
    for (const DynamicError& e : report.errors) {
        text += fmt::format("{:.6f},{:.5f},{:.4f},{:.5f},{:.5f},{:.6f}\n", e.time_s, e.speed_m_s, e.acceleration_m_s2,
                            1e3 * e.position_m, 1e3 * e.along_m, kDegrees * e.orientation_rad);
    }
    return text;
}

Json dynamic_result(const DynamicReport& r) {
    const auto vector = [](const Vec3<double>& v) { return Json{v.x(), v.y(), v.z()}; };
    const auto rotation = [](const Quat<double>& q) { return Json{q.w(), q.x(), q.y(), q.z()}; };
    Json json{{"poses", r.errors.size()},
              {"position_rms_m", r.position_m.rms},
              {"position_p95_m", r.position_m.p95},
              {"position_max_m", r.position_m.max},
              {"orientation_rms_deg", r.orientation_deg.rms},
              {"orientation_p95_deg", r.orientation_deg.p95},
              {"orientation_max_deg", r.orientation_deg.max},
              {"time_offset_s", r.alignment.time_offset_s},
              {"lag_s", r.lag_s},
              {"poses_in_gaps", r.in_gaps},
              {"error_at_rest_m", r.at_rest_m},
              {"error_per_speed_s", r.per_speed_s},
              {"error_per_acceleration_s2", r.per_acceleration_s2},
              {"q_world", rotation(r.alignment.q_world)},
              {"world_m", vector(r.alignment.world_m)},
              {"q_mount", rotation(r.alignment.q_mount)},
              {"mount_m", vector(r.alignment.mount_m)},
              {"bands", Json::array()}};
    for (const SpeedBand& b : r.bands) {
        json["bands"].push_back({{"from_m_s", b.from_m_s},
                                 {"to_m_s", b.to_m_s},
                                 {"poses", b.poses},
                                 {"position_rms_m", b.position_rms_m},
                                 {"orientation_rms_deg", b.orientation_rms_deg}});
    }
    return json;
}

std::string dynamic_text(const Json& r) {
    std::string text = fill(r, "{poses} poses compared; reference clock minus tracker clock {time_offset_s in ms:+.3f} ms\n");
    text += r["poses_in_gaps"] > 0 ? fill(r, "  {poses_in_gaps} poses not compared: gaps in the reference\n") : "";
    text += fill(r,
                 "  position     RMS {position_rms_m in mm:.3f} mm   95 % {position_p95_m in mm:.3f} mm   "
                 "max {position_max_m in mm:.3f} mm\n"
                 "  orientation  RMS {orientation_rms_deg:.4f} deg  95 % {orientation_p95_deg:.4f} deg  "
                 "max {orientation_max_deg:.4f} deg\n");
    for (const Json& band : r["bands"]) {
        if (band["poses"] > 0) {
            const char* const speeds = band["to_m_s"] == HUGE_VAL ? "above {from_m_s:.2f}" : "{from_m_s:.2f} to {to_m_s:.2f}";
            text += fmt::format("  {:>13} m/s", fill(band, speeds));
            text += fill(band, "  {poses:6} poses  RMS {position_rms_m in mm:.3f} mm  {orientation_rms_deg:.4f} deg\n");
        }
    }
    return text + fill(r,
                       "  position error^2 = ({error_at_rest_m in mm:.3f} mm)^2 + ({error_per_speed_s in ms:.3f} ms speed)^2 + "
                       "({error_per_acceleration_s2 in ms^2:.2f} ms^2 acceleration)^2; lag {lag_s in ms:+.3f} ms\n");
}

}  // namespace tricoil::host
