#include "board/host/run/run_score.hpp"

#include <cmath>

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"

namespace tricoil::host {

RunScore::RunScore(const sim::Motion& motion, const sim::CoilWorld& world, const sim::SimulatedClock& clock,
                   const signal::AcquisitionPlan& plan, int poses_per_bound)
    : motion_(motion),
      world_(world),
      clock_(clock),
      window_s_(plan.window_s()),
      poses_per_bound_(static_cast<std::size_t>(poses_per_bound)) {}

PoseError RunScore::add(const tracking::PoseEstimate<double>& estimate) {
    PoseError error;
    error.time_s = clock_.elapsed_s(estimate.time);
    error.truth = motion_.at(error.time_s);
    error.position_m = (estimate.position_m - error.truth.position_m).norm();
    error.orientation_rad = geometry::angle_between(estimate.q_source_sensor, error.truth.q_source_sensor);
    const double range = error.truth.position_m.norm();
    if (error.time_s < kScoreSettling_s) {
        return error;
    }
    if (range < kNearestScored_m || range > kFarthestScored_m) {
        ++totals_.out_of_range;
    } else if (!estimate.valid()) {
        ++totals_.invalid;
    } else {
        if (position_m_.size() % poses_per_bound_ == 0) {
            add_bound(error);
        }
        position_m_.push_back(error.position_m);
        orientation_rad_.push_back(error.orientation_rad);
        totals_.expected_position_m += estimate.covariance.topLeftCorner<3, 3>().trace();
        totals_.expected_orientation_rad += estimate.covariance.bottomRightCorner<3, 3>().trace();
        totals_.distorted += estimate.flags.has(tracking::PoseFlag::distorted) ? 1U : 0U;
        if (estimate.predicted_error) {
            add_prediction(estimate.predicted_error->total);
        }
    }
    return error;
}

/// Cramer-Rao bound at the true pose, and blur of the window: the mean over a window of length tau is X + X'' tau^2 / 24.
void RunScore::add_bound(const PoseError& error) {
    const Vec3<double>& p = error.truth.position_m;
    const double c = world_.params().coupling_constant_m3;
    const double range = p.norm();
    const double k = field::coupling_strength(c, range);
    const double sigma = world_.coupling_sigma();
    const Mat6<double> covariance = solver::pose_covariance<double>(k, range, p / range, sigma);

    const auto model = [&](double time_s) {
        const sim::Pose pose = motion_.at(time_s);
        return field::signal_matrix<double>(c, pose.position_m, geometry::attitude_matrix(pose.q_source_sensor));
    };
    const double h = window_s_ / 2;
    const Mat3<double> x = model(error.time_s);
    const Mat3<double> second_difference = model(error.time_s + h) - 2 * x + model(error.time_s - h);
    const auto blurred = solver::solve_direct<double>(x + second_difference * (window_s_ * window_s_ / (24 * h * h)), c);
    if (!blurred.ok()) {
        return;
    }
    const double blur = (blurred->position_towards(p) - p).squaredNorm();
    const double turn = geometry::angle_between(geometry::attitude_quaternion(blurred->attitude), error.truth.q_source_sensor);
    totals_.blur_position_m += blur;
    totals_.bound_position_m += covariance.topLeftCorner<3, 3>().trace() + blur;
    totals_.bound_orientation_rad += covariance.bottomRightCorner<3, 3>().trace() + turn * turn;
    totals_.snr_db += 20 * std::log10(k / sigma);
    ++bounds_;
}

void RunScore::add_prediction(const error_model::ErrorTerm<double>& total) {
    totals_.predicted_position_m += total.position_m * total.position_m;
    totals_.predicted_orientation_rad += total.rotation_rad * total.rotation_rad;
    ++predictions_;
}

ScoreSummary RunScore::summary() const {
    ScoreSummary summary = totals_;
    summary.scored = position_m_.size();
    summary.position_m = summarise(position_m_);
    summary.orientation_rad = summarise(orientation_rad_);
    const double scored = summary.scored == 0 ? 1 : static_cast<double>(summary.scored);
    summary.expected_position_m = std::sqrt(totals_.expected_position_m / scored);
    summary.expected_orientation_rad = std::sqrt(totals_.expected_orientation_rad / scored);
    const double n = bounds_ == 0 ? 1 : static_cast<double>(bounds_);
    summary.bound_position_m = std::sqrt(totals_.bound_position_m / n);
    summary.bound_orientation_rad = std::sqrt(totals_.bound_orientation_rad / n);
    summary.blur_position_m = std::sqrt(totals_.blur_position_m / n);
    const double predictions = predictions_ == 0 ? 1 : static_cast<double>(predictions_);
    summary.predicted_position_m = std::sqrt(totals_.predicted_position_m / predictions);
    summary.predicted_orientation_rad = std::sqrt(totals_.predicted_orientation_rad / predictions);
    summary.snr_db = totals_.snr_db / n;
    return summary;
}

}  // namespace tricoil::host
