#include "sim/motion/recorded_motion.hpp"

#include <cmath>
#include <stdexcept>

#include "core/linear/eigen.hpp"
#include "sim/motion/zero_phase_filter.hpp"

namespace tricoil::sim {
namespace {

using Spline = CubicSpline<7>;
using Point = Spline::Point;

/// q and -q are the same attitude: chooses the sign closer to the previous point.
Point to_point(const Pose& pose, const Point& before) {
    Point point;
    point << pose.position_m, pose.q_source_sensor.coeffs();
    if (point.tail<4>().dot(before.tail<4>()) < 0) {
        point.tail<4>() *= -1;
    }
    return point;
}

/// Recorders repeat the last sample when they have no new one. Returns a spline through the distinct samples, on the recording's
/// own times.
Spline fit_distinct(const std::vector<Pose>& recording, double rate_hz) {
    std::vector<double> times;
    Spline::Points points;
    Point before = to_point(recording.front(), Point::Zero());
    for (std::size_t i = 0; i < recording.size(); ++i) {
        const Point point = to_point(recording[i], before);
        if (points.empty() || point != before) {
            times.push_back(static_cast<double>(i) / rate_hz);
            points.push_back(point);
        }
        before = point;
    }
    if (points.size() < 8) {
        throw std::invalid_argument(
            "recorded motion: fewer than 8 samples differ; the sensor was not moved or the file repeats itself");
    }
    return {std::move(times), std::move(points)};
}

}  // namespace

RecordedMotion::RecordedMotion(const std::vector<Pose>& recording, const RecordedMotionParams& params) : speed_(params.speed) {
    if (!(params.sample_rate_hz > 0) || !(params.speed > 0) || !std::isfinite(params.sample_rate_hz + params.speed)) {
        throw std::invalid_argument("recorded motion: sample rate and speed must be positive");
    }
    if (!(params.cutoff_hz > 0) || !(params.cutoff_hz < params.sample_rate_hz / 2)) {
        throw std::invalid_argument("recorded motion: the smoothing cutoff must lie between zero and half the sample rate");
    }
    const Spline rough = fit_distinct(recording, params.sample_rate_hz);
    const auto count = static_cast<std::size_t>((rough.end_s() - rough.begin_s()) * params.sample_rate_hz) + 1;
    Eigen::MatrixXd samples(static_cast<Index>(count), kDimension);
    for (std::size_t i = 0; i < count; ++i) {
        samples.row(static_cast<Index>(i)) =
            eigen(rough.at(rough.begin_s() + static_cast<double>(i) / params.sample_rate_hz)).transpose();
    }
    Eigen::MatrixXd smooth = zero_phase_low_pass(samples, params.cutoff_hz / params.sample_rate_hz);
    const Eigen::RowVector3d shift = eigen(params.place_m).transpose() - smooth.leftCols<3>().colwise().mean();
    smooth.leftCols<3>().rowwise() += shift;

    std::vector<double> times(count);
    Spline::Points points(count);
    for (std::size_t i = 0; i < count; ++i) {
        times[i] = static_cast<double>(i) / params.sample_rate_hz;
        points[i] = smooth.row(static_cast<Index>(i)).transpose();
    }
    spline_ = Spline(std::move(times), std::move(points));
}

Pose RecordedMotion::do_at(double time_s) const {
    const Point point = spline_.at(time_s * speed_);
    return {point.head<3>(), Quat<double>(point.tail<4>()).normalized()};
}

}  // namespace tricoil::sim
