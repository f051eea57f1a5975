#include "board/host/serve/web/compact_pose.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace tricoil::host::web {
namespace {

constexpr double kLowestSnr_db = -200;  // without a signal the ratio is minus infinity

double finite_or(double value, double other) { return std::isfinite(value) ? value : other; }

}  // namespace

bool is_finite(const tracking::PoseEstimate<double>& pose) {
    return pose.position_m.allFinite() && pose.q_source_sensor.coeffs().allFinite() && pose.covariance.allFinite();
}

void put_compact(const ServedPose& served, std::string& out) {
    const auto& e = served.pose;
    const auto& p = e.position_m;
    const auto& q = e.q_source_sensor;
    const auto& c = e.covariance;
    const auto put = std::back_inserter(out);
    fmt::format_to(put, "[{},{},{:.3f},{},{},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f}", e.sensor, to_us(e.time),
                   1e-3 * static_cast<double>(to_us(served.utc)), e.flags.bits(), static_cast<int>(e.state), p.x(), p.y(), p.z(),
                   q.w(), q.x(), q.y(), q.z());
    fmt::format_to(put, ",{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}", c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2));
    const double error_m = e.predicted_error ? e.predicted_error->total.position_m : std::nan("");
    std::isfinite(error_m) ? fmt::format_to(put, ",{:.4g}", 1e3 * error_m) : fmt::format_to(put, ",null");
    fmt::format_to(put, ",{:.4g},{:.2f}]", 1e3 * finite_or(e.distortion_m, 0), finite_or(e.snr_db, kLowestSnr_db));
}

}  // namespace tricoil::host::web
