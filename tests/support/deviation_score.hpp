// Compares the errors of predicted poses with the deviations that they state.
#pragma once

#include <cmath>
#include <cstddef>

#include "tests/support/column_replay.hpp"

namespace tricoil::test {

/// Sums over poses of which the filter has a measurement, after the first half second and with a range of 0.15 to 2 m. A pose
/// that is only uncertain counts, too.
struct DeviationScore {
    double squares_m2 = 0;
    double stated_m2 = 0;
    double squares_rad2 = 0;
    double stated_rad2 = 0;
    std::size_t count = 0;
    std::size_t invalid = 0;  // of all

    template <typename Scalar>
    void add(const tracking::PoseEstimate<Scalar>& e, const sim::Motion& motion, Microseconds ahead) {
        const sim::Pose truth = motion.at(to_seconds(e.time));
        const double range_m = truth.position_m.norm();
        if (to_seconds(e.time - ahead) < 0.5 || range_m < 0.15 || range_m > 2) {
            return;
        }
        invalid += e.valid() ? 0U : 1U;
        auto flags = e.flags;
        flags.clear(tracking::PoseFlag::uncertain);
        if (flags.has_any(tracking::kInvalidating)) {
            return;
        }
        ++count;
        const Quat<double> q = e.q_source_sensor.template cast<double>();
        squares_m2 += (e.position_m.template cast<double>() - truth.position_m).squaredNorm();
        squares_rad2 += geometry::quaternion_to_rotation_vector<double>(q * truth.q_source_sensor.conjugate()).squaredNorm();
        stated_m2 += static_cast<double>(e.covariance.template topLeftCorner<3, 3>().trace());
        stated_rad2 += static_cast<double>(e.covariance.template bottomRightCorner<3, 3>().trace());
    }
    void add(const DeviationScore& other) {
        squares_m2 += other.squares_m2;
        stated_m2 += other.stated_m2;
        squares_rad2 += other.squares_rad2;
        stated_rad2 += other.stated_rad2;
        count += other.count;
        invalid += other.invalid;
    }

    [[nodiscard]] double rms_m() const { return std::sqrt(squares_m2 / static_cast<double>(count)); }
    [[nodiscard]] double stated_m() const { return std::sqrt(stated_m2 / static_cast<double>(count)); }
    [[nodiscard]] double rms_rad() const { return std::sqrt(squares_rad2 / static_cast<double>(count)); }
    [[nodiscard]] double ratio() const { return std::sqrt(stated_m2 / squares_m2); }
    [[nodiscard]] double rotation_ratio() const { return std::sqrt(stated_rad2 / squares_rad2); }
};

/// The predictions of a SCAAT filter along a motion, which must extend over params.duration_s.
template <typename Scalar>
DeviationScore score_predictions(const sim::Motion& motion, ReplayParams params, Microseconds ahead) {
    auto settings = scaat_params<Scalar>(params.tdm, motion.at(0).position_m);
    std::get<tracking::ScaatParams<Scalar>>(settings.method).predict_ahead = ahead;
    auto filter = scaat_filter<Scalar>(settings);
    params.duration_s -= to_seconds(ahead);
    DeviationScore score;
    replay<Scalar>(motion, params, [&](const Column<Scalar>& column) {
        if (const auto estimate = filter.update(column)) {
            score.add(*estimate, motion, ahead);
        }
    });
    return score;
}

}  // namespace tricoil::test
