// Counts valid poses, and valid poses whose error exceeds 5 sigma.
#pragma once

#include <algorithm>
#include <cstdio>

#include "core/tracking/pose_estimate.hpp"
#include "sim/motion/motion.hpp"
#include "tests/support/squared_sigmas.hpp"

namespace tricoil::test {

struct Tally {
    std::size_t valid = 0;
    std::size_t beyond_5_sigma = 0;  // valid poses with an error above 5 sigma
    std::size_t poses = 0;
    double worst_beyond_m = 0;
    double first_flag_s = 1e9;     // first invalid pose after the fault began
    double longest_silence_s = 0;  // between poses
    double last_s = 0;

    void add(const tracking::PoseEstimate<double>& e, const sim::Motion& motion, double begin_s) {
        const double t = to_seconds(e.time);
        longest_silence_s = poses++ > 0 ? std::max(longest_silence_s, t - last_s) : 0;
        last_s = t;
        if (!e.valid()) {
            first_flag_s = t >= begin_s ? std::min(first_flag_s, t - begin_s) : first_flag_s;
            return;
        }
        ++valid;
        const Vec3<double> d = e.position_m - motion.at(t).position_m;
        if (squared_sigmas(d, e.covariance.topLeftCorner<3, 3>()) > 25) {
            ++beyond_5_sigma;
            worst_beyond_m = std::max(worst_beyond_m, d.norm());
        }
    }
    void add(const Tally& other) {
        valid += other.valid;
        beyond_5_sigma += other.beyond_5_sigma;
        poses += other.poses;
        worst_beyond_m = std::max(worst_beyond_m, other.worst_beyond_m);
    }
    void print(const char* what) const {
        std::printf("%s: %zu of %zu valid poses beyond 5 sigma, worst %.1f mm, %zu poses\n", what, beyond_5_sigma, valid,
                    1e3 * worst_beyond_m, poses);
    }
};

}  // namespace tricoil::test
