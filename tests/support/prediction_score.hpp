// Scores the positions that a filter predicts against those that perfect knowledge of the velocity would give.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tests/support/column_replay.hpp"

namespace tricoil::test {

/// Position errors of poses predicted by the filter, and of its poses moved with the true velocity.
struct PredictionScore {
    static constexpr std::array<double, 3> kAhead_s{0.005, 0.01, 0.02};
    std::array<std::vector<double>, 3> predicted_m;
    std::array<std::vector<double>, 3> with_true_velocity_m;

    [[nodiscard]] double predicted_rms_m(std::size_t n) const { return host::summarise(predicted_m[n]).rms; }
    [[nodiscard]] double true_velocity_rms_m(std::size_t n) const { return host::summarise(with_true_velocity_m[n]).rms; }
    [[nodiscard]] double ratio(std::size_t n) const { return predicted_rms_m(n) / true_velocity_rms_m(n); }
};

/// Adds the predictions of a SCAAT filter along a motion to `score`. The motion must extend over params.duration_s.
inline void add_predictions(const sim::Motion& motion, ReplayParams params, PredictionScore& score) {
    constexpr double kStep_s = 1e-4;  // for the true velocity
    auto filter = scaat_filter<double>(scaat_params<double>(params.tdm, motion.at(0).position_m));
    params.duration_s -= PredictionScore::kAhead_s.back() + kStep_s;
    replay<double>(motion, params, [&](const Column<double>& column) {
        const auto estimate = filter.update(column);
        const double t = to_seconds(column.midpoint);
        if (!estimate || !estimate->valid() || t < 0.5) {
            return;
        }
        const Vec3<double> velocity_m_s = (motion.at(t + kStep_s).position_m - motion.at(t - kStep_s).position_m) / (2 * kStep_s);
        for (std::size_t n = 0; n < PredictionScore::kAhead_s.size(); ++n) {
            const double ahead_s = PredictionScore::kAhead_s[n];
            const Vec3<double> truth = motion.at(t + ahead_s).position_m;
            auto state = filter.motion();
            tracking::scaat::propagate(state, filter.filter_state().intensity, state.time + microseconds_from_seconds(ahead_s));
            score.predicted_m[n].push_back((state.position_m - truth).norm());
            score.with_true_velocity_m[n].push_back((estimate->position_m + ahead_s * velocity_m_s - truth).norm());
        }
    });
}

}  // namespace tricoil::test
