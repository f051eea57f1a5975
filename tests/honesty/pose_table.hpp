// One row of a table of poses: share of valid and flagged poses, errors, and poses beyond five of their standard deviations.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/geometry/rotations.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "sim/motion/motion.hpp"
#include "tests/support/squared_sigmas.hpp"

namespace tricoil::test {

struct PoseRow {
    std::size_t poses = 0;
    std::size_t valid = 0;
    std::size_t distorted = 0;       // with this flag, valid or not
    std::size_t beyond_5_sigma = 0;  // valid; Mahalanobis distance of position or rotation
    std::size_t above_limit = 0;     // valid; standard deviation of the position above max_deviation_m
    std::vector<double> error_m;     // of valid poses
    std::vector<double> shown;       // stated distortion in errors, of valid poses with this flag

    void add(const tracking::PoseEstimate<double>& e, const sim::Pose& truth, double max_deviation_m) {
        ++poses;
        distorted += e.flags.has(tracking::PoseFlag::distorted) ? 1U : 0U;
        if (!e.valid()) {
            return;
        }
        ++valid;
        const Vec3<double> dp = e.position_m - truth.position_m;
        const Vec3<double> dr =
            geometry::quaternion_to_rotation_vector<double>(e.q_source_sensor * truth.q_source_sensor.conjugate());
        const bool within =
            is_within(dp, e.covariance.topLeftCorner<3, 3>()) && is_within(dr, e.covariance.bottomRightCorner<3, 3>());
        beyond_5_sigma += within ? 0U : 1U;
        above_limit += tracking::deviation_m(e) <= max_deviation_m ? 0U : 1U;
        error_m.push_back(dp.norm());
        if (e.flags.has(tracking::PoseFlag::distorted)) {
            shown.push_back(e.distortion_m / dp.norm());
        }
    }

    void add(const PoseRow& other) {
        poses += other.poses;
        valid += other.valid;
        distorted += other.distorted;
        beyond_5_sigma += other.beyond_5_sigma;
        above_limit += other.above_limit;
        error_m.insert(error_m.end(), other.error_m.begin(), other.error_m.end());
        shown.insert(shown.end(), other.shown.begin(), other.shown.end());
    }

    [[nodiscard]] double share(std::size_t count, std::size_t all) const {
        return all > 0 ? static_cast<double>(count) / static_cast<double>(all) : 0;
    }
    [[nodiscard]] double distorted_share() const { return share(distorted, poses); }
    [[nodiscard]] double beyond_share() const { return share(beyond_5_sigma, valid); }
    [[nodiscard]] double max_m() const { return error_m.empty() ? 0 : *std::max_element(error_m.begin(), error_m.end()); }

    /// Of the poses with a stated distortion, this share states fewer errors than this.
    [[nodiscard]] double shown_quantile(double share_below) const {
        std::vector<double> sorted = shown;
        std::sort(sorted.begin(), sorted.end());
        return sorted.empty() ? 0 : sorted[static_cast<std::size_t>(share_below * static_cast<double>(sorted.size() - 1))];
    }

    static void print_header() {
        std::printf("%-44s %8s %8s %10s %9s %9s %9s %10s %18s\n", "", "poses", "valid %", "distorted %", "RMS mm", "99.9 % mm",
                    "max mm", "> 5 sigma", "distortion / error");
    }
    void print(const std::string& name) const {
        std::vector<double> sorted = error_m;
        std::sort(sorted.begin(), sorted.end());
        double squares = 0;
        for (const double e : sorted) {
            squares += e * e;
        }
        const auto n = static_cast<double>(std::max<std::size_t>(sorted.size(), 1));
        const double p999 = sorted.empty() ? 0 : sorted[static_cast<std::size_t>(0.999 * static_cast<double>(sorted.size() - 1))];
        std::printf("%-44s %8zu %8.2f %10.3f %9.4f %9.3f %9.3f %9.4f%%   5 %% %5.2f, median %5.2f\n", name.c_str(), poses,
                    100 * share(valid, poses), 100 * distorted_share(), 1e3 * std::sqrt(squares / n), 1e3 * p999, 1e3 * max_m(),
                    100 * beyond_share(), shown_quantile(0.05), shown_quantile(0.5));
    }

private:
    static bool is_within(const Vec3<double>& error, const Mat3<double>& covariance) {
        constexpr double kFiveSigmaSquared = 25;
        return squared_sigmas(error, covariance) <= kFiveSigmaSquared;
    }
};

}  // namespace tricoil::test
