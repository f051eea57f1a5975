// Returns of an unplugged sensor, through the full signal chain: the first valid pose after it, and poses on the wrong side.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "sim/motion/simple_motions.hpp"
#include "tests/honesty/pose_table.hpp"
#include "tests/support/chain_run.hpp"

namespace tricoil::test {

/// Hand motion whose centre turns about the source, by half a turn between two times.
class CarriedRound final : public sim::Motion {
public:
    CarriedRound(const Vec3<double>& centre_m, const Vec3<double>& axis, double begin_s, double end_s, std::uint64_t seed)
        : hand_(centre_m, seed), axis_(axis), begin_s_(begin_s), end_s_(end_s) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override {
        const double s = std::clamp((t - begin_s_) / (end_s_ - begin_s_), 0.0, 1.0);
        const double angle_rad = std::numbers::pi * s * s * (3 - 2 * s);
        const Quat<double> turn = geometry::rotation_vector_to_quaternion<double>(angle_rad * axis_);
        const sim::Pose pose = hand_.at(t);
        return {turn * pose.position_m, turn * pose.q_source_sensor};
    }

    sim::HandMotion hand_;
    Vec3<double> axis_;
    double begin_s_;
    double end_s_;
};

/// One of the methods of one band, deskewed in TDM.
inline tracking::MethodParams<double> method_of_one_band(int index, bool is_tdm) {
    switch (index) {
        case 0:
            return tracking::DirectParams{is_tdm};
        case 1:
            return tracking::PreviousParams{1, is_tdm};
        default:
            return tracking::ScaatParams<double>{};
    }
}
constexpr std::array kMethodsOfOneBand{"direct", "previous", "scaat"};

struct Return {
    std::optional<double> after_s;  // first valid pose after the loss; empty: none within half a second
    PoseRow poses;                  // from the loss on
};

struct LossCase {
    bool is_tdm = true;
    int method = 0;
    double loss_s = 0.01;
    bool is_carried = false;  // round the source, during the loss
    std::uint64_t seed = 1;
};

inline Return return_after(const LossCase& loss) {
    constexpr double kBefore_s = 0.6;
    constexpr double kAfter_s = 0.5;
    std::mt19937_64 random(loss.seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double begin_s = kBefore_s + 0.01 * uniform(random);  // at any time within a block
    const double end_s = begin_s + loss.loss_s;
    // Half way round within the reach of a hand of 3 m/s: 0.2 m of its motion included.
    const double farthest_m = std::min(0.75, 1.35 * loss.loss_s - 0.2);
    const double range_m = loss.is_carried ? 0.3 + (farthest_m - 0.3) * uniform(random) : 0.75;
    const double tilt_rad = 2 * std::numbers::pi * uniform(random);
    const Vec3<double> axis(0, std::cos(tilt_rad), std::sin(tilt_rad));
    const double turn_end_s = loss.is_carried ? end_s : 1e6;
    const CarriedRound motion({range_m, 0, 0}, axis, loss.is_carried ? begin_s : 0.5e6, turn_end_s, loss.seed);
    ChainParams chain;
    chain.tdm = loss.is_tdm;
    chain.method = method_of_one_band(loss.method, loss.is_tdm);
    chain.duration_s = end_s + kAfter_s;
    chain.seed = loss.seed;
    chain.faults = {"unplugged@" + std::to_string(begin_s) + "-" + std::to_string(end_s)};
    Return result;
    run_chain(motion, chain, [&](const tracking::PoseEstimate<double>& e, double) {
        const double time_s = to_seconds(e.time);
        if (time_s < begin_s) {
            return;
        }
        result.poses.add(e, motion.at(time_s), tracking::CommonParams<double>{}.max_deviation_m);
        if (e.valid() && time_s > end_s && !result.after_s) {
            result.after_s = time_s - end_s;
        }
    });
    return result;
}

/// Runs of several seeds.
struct ReturnRow {
    int runs = 0;
    int late = 0;   // without a valid pose within 50 ms
    int wrong = 0;  // with a valid pose farther than 5 cm from the sensor
    double slowest_s = 0;
    PoseRow poses;
};

/// Plays the loss with the seeds 1 to `seeds` and prints the row.
inline ReturnRow return_row(LossCase loss, int seeds) {
    constexpr double kSoon_s = 0.05;
    constexpr double kFar_m = 0.05;
    ReturnRow row;
    for (int seed = 1; seed <= seeds; ++seed) {
        loss.seed = static_cast<std::uint64_t>(seed);
        const Return back = return_after(loss);
        ++row.runs;
        row.late += back.after_s && *back.after_s <= kSoon_s ? 0 : 1;
        row.wrong += back.poses.max_m() > kFar_m ? 1 : 0;
        row.slowest_s = std::max(row.slowest_s, back.after_s.value_or(1));
        row.poses.add(back.poses);
    }
    std::printf("%s %-8s %5.0f ms%s, %3d runs: %3d later than 50 ms (slowest %.0f ms), %d wrong and valid; ",
                loss.is_tdm ? "tdm" : "fdm", kMethodsOfOneBand[static_cast<std::size_t>(loss.method)], 1e3 * loss.loss_s,
                loss.is_carried ? " carried" : "", row.runs, row.late, 1e3 * row.slowest_s, row.wrong);
    row.poses.print("");
    return row;
}

}  // namespace tricoil::test
