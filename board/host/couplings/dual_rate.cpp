#include "board/host/couplings/dual_rate.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/quaternion_sign.hpp"
#include "core/geometry/rotations.hpp"
#include "core/solver/cold_start.hpp"

namespace tricoil::host {
namespace {

constexpr double kFirstBias = 0.03;       // sigma of the bias before the first low-band line: share of the range, and rad
constexpr double kFirstSpeed = 0.5;       // m/s
constexpr double kFirstTurn = 3;          // rad/s
constexpr double kHighNoiseShare = 0.01;  // weight of each row in the running noise power
constexpr double kLowNoiseShare = 0.1;    // weight of each line

SplitParams scaled(SplitParams params, double unit) {
    params.min_noise *= unit * unit;
    return params;
}

}  // namespace

/// Both bands over the last two lines.
struct DualRateEstimator::Comparison {
    Vec6<double> disagreement;  // high - low: position, small rotation
    Vec3<double> position_m;    // means of the high band
    Vec3<double> rotation_rad;
    tracking::Vec9 low_redundant;  // parts of the couplings that no pose explains, both in units of the low band
    tracking::Vec9 high_redundant;
    double low_norm;          // of the low band's couplings
    Mat6<double> covariance;  // of the low band's pose, for unit noise of each coupling
};

DualRateEstimator::DualRateEstimator(const field::GeneralDipole<double>& high, const field::GeneralDipole<double>& low,
                                     const DualRateParams& params)
    : high_(high),
      low_(low),
      params_(params),
      gain_((low.sensor_sensitivity.colwise().norm().transpose() * low.source_moment.colwise().norm())
                .cwiseQuotient(high.sensor_sensitivity.colwise().norm().transpose() * high.source_moment.colwise().norm())),
      scalar_(params.scalar),
      position_(params.split, params.row_period_s, params.rows_per_line) {}

Result<DualRatePose> DualRateEstimator::add_high(const Mat3<double>& couplings) {
    if (!couplings.allFinite()) {
        return Status{StatusCode::not_finite, "couplings of the high band contain NaN or infinity"};
    }
    if (couplings.isZero(0)) {
        return Status{StatusCode::degenerate, "couplings of the high band are zero"};
    }
    const bool first = !tracking_;
    const solver::RigidPose<double> before = high_pose_;
    solved_ = solve(couplings);
    if (!solved_) {
        position_.skip_row();
        rotation_.skip_row();
        return report();
    }
    if (first) {
        start();
    } else {
        const Quat<double> turn = high_pose_.q_source_sensor * before.q_source_sensor.conjugate();
        turned_rad_ += geometry::quaternion_to_rotation_vector(turn);
    }
    accumulate();
    position_.add_row(high_pose_.position_m, position_variance_);
    rotation_.add_row(turned_rad_, rotation_variance_);
    return report();
}

void DualRateEstimator::start() {
    const double range = high_pose_.position_m.norm();
    position_ = SplitFilter(params_.split, params_.row_period_s, params_.rows_per_line);
    rotation_ = SplitFilter(scaled(params_.split, 1 / range), params_.row_period_s, params_.rows_per_line);
    position_.start(high_pose_.position_m, kFirstBias * range, kFirstSpeed);
    rotation_.start(turned_rad_, kFirstBias, kFirstTurn);
    this_line_ = Line{};
    last_line_ = Line{};
    compared_ = false;
    line_position_m_ = high_pose_.position_m;
    line_turned_rad_ = turned_rad_;
    end_position_m_ = line_position_m_;
    end_turned_rad_ = turned_rad_;
    held_bias_m_.setZero();
    held_bias_rad_.setZero();
}

bool DualRateEstimator::solve(const Mat3<double>& couplings) {
    solver::RefineParams<double> refine;
    refine.max_misfit_share = params_.max_misfit_share;
    if (tracking_) {
        const auto found = solver::minimise(high_, couplings, Mat3<double>(Mat3<double>::Ones()), high_pose_, refine);
        if (!found.ok() || !found->converged()) {
            return false;
        }
        high_pose_ = found->pose;
    } else if (!cold_start(couplings)) {
        return false;
    }
    last_misfit_ = high_misfit_;
    high_misfit_ = couplings - field::signal_matrix(high_, high_pose_.position_m,
                                                    Mat3<double>(high_pose_.q_source_sensor.conjugate().toRotationMatrix()));
    return true;
}

bool DualRateEstimator::cold_start(const Mat3<double>& couplings) {
    solver::ColdStartParams<double> params;
    params.hemisphere = params_.hemisphere;
    params.refine.max_misfit_share = params_.max_misfit_share;
    const auto found = solver::solve_cold(high_, couplings, Mat3<double>(Mat3<double>::Ones()), params);
    if (!found.ok() || !found->refinement.converged() || !found->right_handed) {
        return false;
    }
    const Quat<double> before = high_pose_.q_source_sensor;
    high_pose_ = found->refinement.pose;
    high_pose_.q_source_sensor = geometry::with_sign_of(high_pose_.q_source_sensor, before);
    tracking_ = true;
    return true;
}

void DualRateEstimator::accumulate() {
    if (this_line_.rows > 0) {  // white noise, from the change of the three redundant numbers from row to row
        const double seen = (high_misfit_ - last_misfit_).squaredNorm() / 6;
        high_variance_ += (high_variance_ > 0 ? kHighNoiseShare : 1) * (seen - high_variance_);
    }
    const double each = 1 / (1 + scalar_.value());
    const Vec3<double> off_m = each * position_.bias();
    const Vec3<double> off_rad = each * rotation_.bias();
    const Quat<double> q =
        (geometry::rotation_vector_to_quaternion(Vec3<double>(-off_rad)) * high_pose_.q_source_sensor).normalized();
    const auto low =
        field::signal_model(low_, Vec3<double>(high_pose_.position_m - off_m), Mat3<double>(q.conjugate().toRotationMatrix()));
    ++this_line_.rows;
    this_line_.expected.head<3>() += off_m;
    this_line_.expected.tail<3>() += off_rad;
    this_line_.low_model += low.x;
    this_line_.jacobian += low.jacobian;
    this_line_.high_residual += tracking::vec(gain_.cwiseProduct(high_misfit_));
    this_line_.position_m += high_pose_.position_m;
    this_line_.rotation_rad += turned_rad_;
}

Status DualRateEstimator::add_low(const Mat3<double>& couplings) {
    Comparison c;
    const bool complete = this_line_.rows == params_.rows_per_line && last_line_.rows == params_.rows_per_line;
    const Status status = complete ? compare(couplings, c) : Status{};
    if (complete && status.ok()) {
        use(c);
    }
    close_line();
    return status;
}

Status DualRateEstimator::compare(const Mat3<double>& low, Comparison& result) const {
    if (!low.allFinite()) {
        return {StatusCode::not_finite, "couplings of the low band contain NaN or infinity"};
    }
    result.low_norm = low.norm();
    const double each = 1 / static_cast<double>(2 * params_.rows_per_line);
    const tracking::PoseJacobian jacobian = each * (last_line_.jacobian + this_line_.jacobian);
    const tracking::Vec9 excess = tracking::vec(each * (last_line_.low_model + this_line_.low_model) - low);
    result.covariance = tracking::unit_covariance(jacobian, high_pose_.position_m.norm());
    if (!(result.covariance(0, 0) > 0)) {
        return {StatusCode::degenerate, "couplings of the low band do not determine a pose here"};
    }
    const auto pose_of = [&](const tracking::Vec9& v) -> Vec6<double> { return result.covariance * (jacobian.transpose() * v); };
    const Vec6<double> unexpected = pose_of(excess);
    result.disagreement = each * (last_line_.expected + this_line_.expected) + unexpected;
    result.low_redundant = jacobian * unexpected - excess;
    const tracking::Vec9 high = each * (last_line_.high_residual + this_line_.high_residual);
    result.high_redundant = high - jacobian * pose_of(high);
    result.position_m = each * (last_line_.position_m + this_line_.position_m);
    result.rotation_rad = each * (last_line_.rotation_rad + this_line_.rotation_rad);
    return {};
}

void DualRateEstimator::use(const Comparison& c) {
    if (compared_) {
        const tracking::Vec9 unexplained =
            c.low_redundant - last_low_redundant_ - scalar_.share() * (c.high_redundant - last_high_redundant_);
        const double seen = unexplained.squaredNorm() / 6;
        low_variance_ += (low_variance_ > 0 ? kLowNoiseShare : 1) * (seen - low_variance_);
    }
    const double stretch = 1 + scalar_.value();
    const double noise = low_variance_ / 3;
    disagreement_m_ = c.disagreement.head<3>();
    held_bias_m_ = stretch * disagreement_m_;
    held_bias_rad_ = stretch * c.disagreement.tail<3>();
    position_.add_means(disagreement_m_, c.position_m, stretch, noise * c.covariance.topLeftCorner<3, 3>().trace());
    rotation_.add_means(Vec3<double>(c.disagreement.tail<3>()), c.rotation_rad, stretch,
                        noise * c.covariance.bottomRightCorner<3, 3>().trace());
    fit_scalar(c);  // for the lines after this one
}

void DualRateEstimator::fit_scalar(const Comparison& c) {
    const Vec3<double> low_m = c.position_m - disagreement_m_;
    if (compared_) {
        // Variance of a change from line to line: twice the variance of one line.
        const double per_axis = 2 * low_variance_ / 3 * c.covariance.topLeftCorner<3, 3>().trace();
        scalar_.add_poses(low_m - last_low_m_, disagreement_m_ - last_disagreement_m_, per_axis);
        const double moved = (low_m - last_low_m_).norm() / low_m.norm();
        const double misfit = params_.misfit_share * moved * c.low_norm;
        scalar_.add_redundant<9>(c.low_redundant - last_low_redundant_, c.high_redundant - last_high_redundant_,
                                 2 * low_variance_, misfit * misfit / 3);
    }
    compared_ = true;
    last_low_m_ = low_m;
    last_disagreement_m_ = disagreement_m_;
    last_low_redundant_ = c.low_redundant;
    last_high_redundant_ = c.high_redundant;
}

void DualRateEstimator::close_line() {
    position_.next_line();
    rotation_.next_line();
    // A held bias has the time of the middle of its window, one line ago.
    line_position_m_ = params_.filter ? high_pose_.position_m : end_position_m_;
    line_turned_rad_ = params_.filter ? turned_rad_ : end_turned_rad_;
    end_position_m_ = high_pose_.position_m;
    end_turned_rad_ = turned_rad_;
    last_line_ = this_line_;
    this_line_ = Line{};
    tracking_ = tracking_ && solved_;  // otherwise restart: the sensor may be anywhere
    if (!tracking_) {
        return;
    }
    const auto model = field::signal_model(high_, high_pose_.position_m,
                                           Mat3<double>(high_pose_.q_source_sensor.conjugate().toRotationMatrix()));
    const Mat6<double> covariance = tracking::unit_covariance(model.jacobian, high_pose_.position_m.norm());
    position_variance_ = high_variance_ / 3 * covariance.topLeftCorner<3, 3>().trace();
    rotation_variance_ = high_variance_ / 3 * covariance.bottomRightCorner<3, 3>().trace();
}

DualRatePose DualRateEstimator::report() const {
    DualRatePose out;
    out.pose = high_pose_;
    out.solved = solved_;
    if (!tracking_) {
        return out;
    }
    const Vec3<double> moved_m = high_pose_.position_m - line_position_m_;
    const Vec3<double> turned_rad = turned_rad_ - line_turned_rad_;
    const Vec3<double> bias_m = params_.filter ? position_.bias() : held_bias_m_;
    const Vec3<double> bias_rad = params_.filter ? rotation_.bias() : held_bias_rad_;
    if (params_.filter) {
        out.pose.position_m = position_.sum() - bias_m;
        const Vec3<double> correction = rotation_.sum() - turned_rad_ - bias_rad;
        out.pose.q_source_sensor =
            (geometry::rotation_vector_to_quaternion(correction) * high_pose_.q_source_sensor).normalized();
    } else {
        out.pose.position_m -= bias_m;
        out.pose.q_source_sensor =
            (geometry::rotation_vector_to_quaternion(Vec3<double>(-bias_rad)) * high_pose_.q_source_sensor).normalized();
    }
    constexpr double kAppears = 1e-3;  // largest new bias within a line: share of the range, and rad
    const double range = out.pose.position_m.norm();
    out.position_sigma_m = sigma_of(position_.variance(), bias_m, moved_m, kAppears * range);
    out.rotation_sigma_rad = sigma_of(rotation_.variance(), bias_rad, turned_rad, kAppears);
    out.distortion_m = bias_m.norm();
    out.valid = solved_ && out.position_sigma_m <= params_.max_sigma_m;
    return out;
}

double DualRateEstimator::sigma_of(double variance, const Vec3<double>& bias, const Vec3<double>& change, double appears) const {
    const double size = bias.norm();
    const double by_scalar = size * scalar_.sigma() / (1 + scalar_.value());
    const double by_spread = size * params_.scalar_spread * scalar_.share();
    // The high band's change since the last line may be bias, up to the largest plausible bias.
    const double plausible = size + 5 * std::sqrt(variance) + appears;
    const double by_split = params_.filter ? params_.split_spread * std::min(change.norm(), plausible) : change.norm();
    return std::sqrt(variance + (by_scalar * by_scalar + by_spread * by_spread + by_split * by_split) / 3);
}

}  // namespace tricoil::host
