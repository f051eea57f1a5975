// Generates columns of a motion from the forward model at their slot times, without samples and converter; scores poses.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "board/support/sim_input/trajectory_file.hpp"
#include "board/support/statistics.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/matrix/direct_tracker.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "tests/support/squared_sigmas.hpp"

namespace tricoil::test {

constexpr double kCoupling = 6.75e-3;    // C of the simulated world
constexpr double kSigmaFloor = 1e-8;     // quantisation of its converter over a window
constexpr double kSlotsPerSecond = 720;  // 240 Hz frames
constexpr Microseconds kTdmSpan{3500};

/// Noise per entry that causes a position error of `cost_m` RMS in the direct solution at 0.75 m
/// (core/solver/pose_covariance.hpp).
inline double sigma_for_cost(double cost_m) {
    const double share = std::sqrt(1 / 13.5 + 2 * 1.25 / 0.5625);
    return cost_m / (share * 0.75) * kCoupling / (0.75 * 0.75 * 0.75);
}

/// Per-entry noise for a signal-to-noise ratio at a range.
inline double sigma_for_snr(double snr_db, double range_m) {
    return field::coupling_strength(kCoupling, range_m) * std::pow(10.0, -snr_db / 20);
}

struct ReplayParams {
    bool tdm = true;
    double sigma = 0;  // noise; the sigma given to trackers is at least kSigmaFloor
    std::uint64_t seed = 1;
    double begin_s = 0;
    double duration_s = 1;
};

/// Generates the column of a slot (TDM) or all three columns of a frame (FDM), and calls `take` with each.
template <typename Scalar, typename Take>
void replay(const sim::Motion& motion, const ReplayParams& params, Take&& take) {
    std::mt19937_64 random(params.seed);
    std::normal_distribution<double> normal(0, 1);
    const double slot_s = params.tdm ? 1 / kSlotsPerSecond : 3 / kSlotsPerSecond;
    const auto slots = static_cast<std::int64_t>(params.duration_s / slot_s);
    for (std::int64_t slot = 0; slot < slots; ++slot) {
        const DeviceTime time{microseconds_from_seconds(params.begin_s + static_cast<double>(slot) * slot_s)};
        const sim::Pose truth = motion.at(to_seconds(time));
        const auto o = geometry::attitude_matrix(truth.q_source_sensor);
        for (int n = 0; n < (params.tdm ? 1 : 3); ++n) {
            const int j = params.tdm ? static_cast<int>(slot % 3) : n;
            Column<Scalar> column;
            column.state = single_coil(j);
            column.midpoint = time;
            column.sequence = column.state_sequence = static_cast<std::uint32_t>(slot);
            Vec3<double> z = field::column_model<double>(kCoupling, truth.position_m, o, j).column;
            z += params.sigma * Vec3<double>(normal(random), normal(random), normal(random));
            column.in_phase = z.cast<Scalar>();
            column.sigma.setConstant(static_cast<Scalar>(std::max(params.sigma, kSigmaFloor)));
            take(column);
        }
    }
}

/// Errors of valid poses after the first half second, range 0.15 to 2 m.
struct Score {
    std::vector<double> position_m;
    std::vector<double> orientation_rad;
    double static_bound_squares = 0;  // of the direct solution for a sensor at rest at the same poses
    double nees_position = 0;         // sums, 3 degrees of freedom each
    double nees_rotation = 0;
    std::size_t beyond_5_sigma = 0;  // Mahalanobis distance of position or rotation above 5
    std::size_t invalid = 0;
    tracking::PoseFlags flags;

    template <typename Scalar>
    void add(const tracking::PoseEstimate<Scalar>& e, const sim::Motion& motion, double sigma, double settling_s = 0.5) {
        const double time_s = to_seconds(e.time);
        const sim::Pose truth = motion.at(time_s);
        const double range = truth.position_m.norm();
        if (time_s < settling_s || range < 0.15 || range > 2) {
            return;
        }
        flags |= e.flags;
        if (!e.valid()) {
            ++invalid;
            return;
        }
        const Vec3<double> dp = e.position_m.template cast<double>() - truth.position_m;
        const Quat<double> q = e.q_source_sensor.template cast<double>();
        const Vec3<double> dr = geometry::quaternion_to_rotation_vector<double>(q * truth.q_source_sensor.conjugate());
        position_m.push_back(dp.norm());
        orientation_rad.push_back(dr.norm());
        const Mat6<double> p = e.covariance.template cast<double>();
        const double np = squared_sigmas(dp, p.topLeftCorner<3, 3>());
        const double nr = squared_sigmas(dr, p.bottomRightCorner<3, 3>());
        nees_position += np;
        nees_rotation += nr;
        beyond_5_sigma += np > 25 || nr > 25 ? 1U : 0U;
        const double k = field::coupling_strength(kCoupling, range);
        static_bound_squares +=
            solver::pose_covariance<double>(k, range, truth.position_m / range, sigma).topLeftCorner<3, 3>().trace();
    }

    void add(const Score& other) {
        position_m.insert(position_m.end(), other.position_m.begin(), other.position_m.end());
        orientation_rad.insert(orientation_rad.end(), other.orientation_rad.begin(), other.orientation_rad.end());
        static_bound_squares += other.static_bound_squares;
        nees_position += other.nees_position;
        nees_rotation += other.nees_rotation;
        beyond_5_sigma += other.beyond_5_sigma;
        invalid += other.invalid;
        flags |= other.flags;
    }

    [[nodiscard]] double count() const { return static_cast<double>(position_m.size()); }
    [[nodiscard]] host::ErrorSummary position() const { return host::summarise(position_m); }
    [[nodiscard]] host::ErrorSummary orientation() const { return host::summarise(orientation_rad); }
    [[nodiscard]] double static_bound_m() const { return std::sqrt(static_bound_squares / count()); }
    [[nodiscard]] double nees_position_per_dof() const { return nees_position / (3 * count()); }
    [[nodiscard]] double nees_rotation_per_dof() const { return nees_rotation / (3 * count()); }
};

/// Tracker parameters for the columns of replay().
template <typename Scalar>
tracking::TrackerParams<Scalar> replay_params(bool tdm, const tracking::MethodParams<Scalar>& method,
                                              const Vec3<double>& hemisphere) {
    tracking::TrackerParams<Scalar> p;
    p.common.coupling_constant = static_cast<Scalar>(kCoupling);
    p.common.max_column_span = tdm ? kTdmSpan : Microseconds{0};
    p.common.hemisphere = hemisphere.cast<Scalar>();
    p.method = method;
    return p;
}

template <typename Scalar>
tracking::TrackerParams<Scalar> direct_params(bool tdm, bool deskew, const Vec3<double>& hemisphere = Vec3<double>::UnitX()) {
    auto params = replay_params<Scalar>(tdm, tracking::DirectParams{deskew}, hemisphere);
    if (!deskew) {
        params.common.max_deviation_m = 1;  // scores uncertain poses of the naive solver, too
    }
    return params;
}

template <typename Scalar>
tracking::DirectTracker<Scalar> direct_tracker(bool tdm, bool deskew, const Vec3<double>& hemisphere = Vec3<double>::UnitX()) {
    return tracking::DirectTracker<Scalar>(direct_params<Scalar>(tdm, deskew, hemisphere));
}

template <typename Scalar>
tracking::TrackerParams<Scalar> scaat_params(bool tdm, const Vec3<double>& hemisphere = Vec3<double>::UnitX()) {
    return replay_params<Scalar>(tdm, tracking::ScaatParams<Scalar>{}, hemisphere);
}

template <typename Scalar>
tracking::ScaatTracker<Scalar> scaat_filter(const tracking::TrackerParams<Scalar>& p) {
    return tracking::ScaatTracker<Scalar>(p);
}

/// Plays a motion through a tracker and scores every pose.
template <typename Scalar, typename Tracker>
Score play(const sim::Motion& motion, const ReplayParams& params, Tracker& tracker) {
    Score score;
    replay<Scalar>(motion, params, [&](const Column<Scalar>& column) {
        if (const auto estimate = tracker.update(column)) {
            score.add(*estimate, motion, params.sigma);
        }
    });
    return score;
}

inline std::unique_ptr<sim::RecordedMotion> recorded_motion(const std::string& file) {
    return std::make_unique<sim::RecordedMotion>(host::read_trajectory(file), sim::RecordedMotionParams{});
}

}  // namespace tricoil::test
