#include "board/host/dynamic/stream_alignment.hpp"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/support/errors.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/cholesky.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kLargestOffset_s = 2;
constexpr double kCoarseOffset_s = 0.02;
constexpr double kOffsetStep_s = 2e-3;
constexpr double kShortestOverlap_s = 1;
constexpr double kMetresPerRadian = 0.5;
constexpr std::size_t kMaxSamples = 3000;
constexpr double kMinCorrelation = 0.7;
constexpr double kLargestResidual = 0.5;  // relative to the spread of the tracker's positions
constexpr int kCorrections = 13;
constexpr double kMinTurning = 1e-3;  // eigenvalue per sample; with a smaller one the rotations are not determined
constexpr const char* kTooFewTurns =
    "the sensor must rotate about two axes, or world frame and mount cannot be separated; record other motion";

using Corrections = Eigen::Matrix<double, kCorrections, 1>;

Quat<double> quaternion(const Eigen::Vector4d& wxyz) { return Quat<double>(wxyz(0), wxyz(1), wxyz(2), wxyz(3)).normalized(); }

Eigen::Matrix4d left_product(const Quat<double>& q) {
    Eigen::Matrix4d m;
    m << q.w(), -q.x(), -q.y(), -q.z(), q.x(), q.w(), -q.z(), q.y(), q.y(), q.z(), q.w(), -q.x(), q.z(), -q.y(), q.x(), q.w();
    return m;
}

Eigen::Matrix4d right_product(const Quat<double>& q) {
    Eigen::Matrix4d m;
    m << q.w(), -q.x(), -q.y(), -q.z(), q.x(), q.w(), q.z(), -q.y(), q.y(), -q.z(), q.w(), q.x(), q.z(), q.y(), -q.x(), q.w();
    return m;
}

/// Angular speed, rad/s; empty in a gap of the stream.
std::optional<double> angular_speed(const PoseStream& stream, double time_s) {
    constexpr double kHalf_s = 0.02;
    if (!stream.covers(time_s - kHalf_s) || !stream.covers(time_s + kHalf_s)) {
        return std::nullopt;
    }
    return geometry::angle_between(stream.at(time_s - kHalf_s).pose.q, stream.at(time_s + kHalf_s).pose.q) / (2 * kHalf_s);
}

/// Indices of at most kMaxSamples tracker poses, evenly spaced, that the reference covers for all offsets within `room_s`.
std::vector<std::size_t> chosen(const PoseStream& tracker, const PoseStream& reference, double offset_s, double room_s) {
    std::vector<std::size_t> all;
    for (std::size_t n = 0; n < tracker.poses().size(); ++n) {
        const double t = tracker.poses()[n].time_s + offset_s;
        if (reference.covers(t - room_s) && reference.covers(t + room_s)) {
            all.push_back(n);
        }
    }
    const std::size_t step = all.size() / kMaxSamples + 1;
    std::vector<std::size_t> some;
    for (std::size_t n = 0; n < all.size(); n += step) {
        some.push_back(all[n]);
    }
    return some;
}

double correlation(const PoseStream& tracker, const PoseStream& reference, double offset_s) {
    double sum_ab = 0;
    double sum_a = 0;
    double sum_b = 0;
    double sum_aa = 0;
    double sum_bb = 0;
    double n = 0;
    const double begin = std::max(tracker.begin_s(), reference.begin_s() - offset_s);
    const double end = std::min(tracker.end_s(), reference.end_s() - offset_s);
    if (end - begin < kShortestOverlap_s) {
        return -1;
    }
    for (double t = begin; t <= end; t += std::max(0.01, (end - begin) / 1000)) {
        const auto of_tracker = angular_speed(tracker, t);
        const auto of_reference = angular_speed(reference, t + offset_s);
        if (!of_tracker || !of_reference) {
            continue;
        }
        const double a = *of_tracker;
        const double b = *of_reference;
        sum_ab += a * b;
        sum_a += a;
        sum_b += b;
        sum_aa += a * a;
        sum_bb += b * b;
        ++n;
    }
    const double spread = (sum_aa - sum_a * sum_a / n) * (sum_bb - sum_b * sum_b / n);
    return spread > 0 ? (sum_ab - sum_a * sum_b / n) / std::sqrt(spread) : -1;
}

double best_offset(const PoseStream& tracker, const PoseStream& reference) {
    double best = 0;
    double highest = -1;
    const auto search = [&](double from, double to, double step) {
        for (double offset = from; offset <= to; offset += step) {
            const double c = correlation(tracker, reference, offset);
            if (c > highest) {
                highest = c;
                best = offset;
            }
        }
    };
    search(-kLargestOffset_s, kLargestOffset_s, kCoarseOffset_s);
    const double near = best;
    search(near - kCoarseOffset_s, near + kCoarseOffset_s, kOffsetStep_s);
    refuse_if(highest < 0, "the streams overlap by less than 1 s at all offsets within 2 s, or their poses do not rotate");
    refuse_if(highest < kMinCorrelation,
              "the angular speeds of the two streams do not agree (correlation at most {:.2f} within 2 s): different motions, or "
              "clocks more than 2 s apart; give --time-offset",
              highest);
    return best;
}

/// Solves q_tracker m = q_world q_reference with m = q_mount^-1. The eight unknowns are the eigenvector of the smallest
/// eigenvalue.
void solve_attitudes(const PoseStream& tracker, const PoseStream& reference, const std::vector<std::size_t>& samples,
                     StreamAlignment& alignment) {
    Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();
    for (const std::size_t n : samples) {
        const TimedPose& p = tracker.poses()[n];
        Eigen::Matrix<double, 4, 8> row;
        row << left_product(p.q), -right_product(reference.at(p.time_s + alignment.time_offset_s).pose.q);
        normal += row.transpose() * row / static_cast<double>(samples.size());
    }
    const SymmetricEigen eigen = eigen_of_symmetric(normal);
    if (eigen.values(1) < kMinTurning) {
        throw InputError(kTooFewTurns);
    }
    const Eigen::Matrix<double, 8, 1> v = eigen.vectors.col(0);
    alignment.q_mount = quaternion(v.head<4>()).conjugate();
    alignment.q_world = quaternion(v.tail<4>());
}

/// Solves p_tracker = R_world p_reference + R_world R_reference mount + world, which is linear in `mount` and `world`.
void solve_positions(const PoseStream& tracker, const PoseStream& reference, const std::vector<std::size_t>& samples,
                     StreamAlignment& alignment) {
    Mat6<double> normal = Mat6<double>::Zero();
    Vec6<double> right = Vec6<double>::Zero();
    for (const std::size_t n : samples) {
        const TimedPose& p = tracker.poses()[n];
        const TimedPose r = reference.at(p.time_s + alignment.time_offset_s).pose;
        Matrix<double, 3, 6> row;
        row << (alignment.q_world * r.q).toRotationMatrix(), Mat3<double>::Identity();
        normal += row.transpose() * row;
        right += row.transpose() * (p.position_m - alignment.q_world * r.position_m);
    }
    const Cholesky<double, 6> factor(normal);
    if (!factor.ok()) {
        throw InputError(kTooFewTurns);
    }
    const Vec6<double> solution = factor.solve(right);
    alignment.mount_m = solution.head<3>();
    alignment.world_m = solution.tail<3>();
}

/// Residuals of the refinement. Parameters: time offset, small rotation and translation of the world, then of the mount.
struct Residuals {
    const PoseStream* tracker;
    const PoseStream* reference;
    const std::vector<std::size_t>* samples;
    StreamAlignment start;
    bool fixed_offset;

    [[nodiscard]] int values() const { return static_cast<int>(6 * samples->size()); }

    [[nodiscard]] StreamAlignment moved(const Corrections& x) const {
        StreamAlignment a = start;
        (fixed_offset ? a.lag_s : a.time_offset_s) += fixed_offset ? -x(0) : x(0);
        a.q_world = geometry::rotation_vector_to_quaternion<double>(x.segment<3>(1)) * a.q_world;
        a.world_m += Vec3<double>(x.segment<3>(4));
        a.q_mount = geometry::rotation_vector_to_quaternion<double>(x.segment<3>(7)) * a.q_mount;
        a.mount_m += Vec3<double>(x.segment<3>(10));
        return a;
    }

    bool operator()(double const* const* x, double* all) const {
        const StreamAlignment a = moved(Eigen::Map<const Corrections>(x[0]));
        Eigen::Map<Eigen::VectorXd> residuals(all, values());
        for (std::size_t n = 0; n < samples->size(); ++n) {
            const TimedPose& p = tracker->poses()[(*samples)[n]];
            const TimedPose r = a.applied(*reference, p.time_s - a.lag_s).pose;
            const auto at = static_cast<Index>(6 * n);
            residuals.segment<3>(at) = eigen(p.position_m - r.position_m);
            residuals.segment<3>(at + 3) =
                kMetresPerRadian * eigen(geometry::quaternion_to_rotation_vector<double>(p.q * r.q.conjugate()));
        }
        return true;
    }
};

/// Throws InputError if the residuals are large: the fit always gives a result, even for streams of different motions.
void refuse_different_motions(const PoseStream& tracker, const std::vector<std::size_t>& samples, const Residuals& residuals,
                              const Corrections& x) {
    Vec3<double> mean = Vec3<double>::Zero();
    for (const std::size_t n : samples) {
        mean += tracker.poses()[n].position_m / static_cast<double>(samples.size());
    }
    double spread = 0;
    for (const std::size_t n : samples) {
        spread += (tracker.poses()[n].position_m - mean).squaredNorm();
    }
    Eigen::VectorXd r(residuals.values());
    const double* const parameters[] = {x.data()};
    residuals(parameters, r.data());
    double left = 0;
    for (std::size_t n = 0; n < samples.size(); ++n) {
        left += r.segment<3>(static_cast<Index>(6 * n)).squaredNorm();
    }
    refuse_if(!(left <= kLargestResidual * kLargestResidual * spread),
              "no coordinate frames align the two streams: {:.1f} mm of {:.1f} mm of motion remain; are these files of the same "
              "motion?",
              1e3 * std::sqrt(left / static_cast<double>(samples.size())),
              1e3 * std::sqrt(spread / static_cast<double>(samples.size())));
}

Corrections refine(const Residuals& residuals) {
    auto* const cost = new ceres::DynamicNumericDiffCostFunction<Residuals, ceres::CENTRAL>(new Residuals(residuals));
    cost->AddParameterBlock(kCorrections);
    cost->SetNumResiduals(residuals.values());
    Corrections x = Corrections::Zero();
    ceres::Problem problem;
    problem.AddResidualBlock(cost, nullptr, x.data());
    ceres::Solver::Options options = silent_options(ceres::DENSE_QR, 50);
    options.function_tolerance = 1e-14;
    (void)summary_of(problem, options);
    return x;
}

}  // namespace

MovingPose StreamAlignment::applied(const PoseStream& reference, double tracker_time_s) const {
    MovingPose r = reference.at(tracker_time_s + time_offset_s);
    const Vec3<double> lever = r.pose.q * mount_m;
    const Vec3<double> swing = r.rate_rad_s.cross(lever);
    r.velocity_m_s = q_world * (r.velocity_m_s + swing);
    r.acceleration_m_s2 =
        q_world * (r.acceleration_m_s2 + r.angular_acceleration_rad_s2.cross(lever) + r.rate_rad_s.cross(swing));
    r.rate_rad_s = q_world * r.rate_rad_s;
    r.angular_acceleration_rad_s2 = q_world * r.angular_acceleration_rad_s2;
    r.pose.time_s = tracker_time_s;
    r.pose.position_m = q_world * (r.pose.position_m + lever) + world_m;
    r.pose.q = (q_world * r.pose.q * q_mount).normalized();
    return r;
}

StreamAlignment align_streams(const PoseStream& tracker, const PoseStream& reference, std::optional<double> given_offset_s) {
    StreamAlignment alignment;
    alignment.time_offset_s = given_offset_s ? *given_offset_s : best_offset(tracker, reference);
    const auto samples = chosen(tracker, reference, alignment.time_offset_s, given_offset_s ? 0 : 2 * kOffsetStep_s);
    refuse_if(samples.size() < 20, "the two streams overlap in fewer than 20 poses; check the times or --time-offset");
    solve_attitudes(tracker, reference, samples, alignment);
    solve_positions(tracker, reference, samples, alignment);
    const Residuals residuals{&tracker, &reference, &samples, alignment, given_offset_s.has_value()};
    const Corrections x = refine(residuals);
    const StreamAlignment found = residuals.moved(x);
    refuse_if(!given_offset_s && std::abs(found.time_offset_s) > kLargestOffset_s + kCoarseOffset_s,
              "the clocks are more than 2 s apart; give --time-offset");
    refuse_different_motions(tracker, samples, residuals, x);
    return found;
}

}  // namespace tricoil::host
