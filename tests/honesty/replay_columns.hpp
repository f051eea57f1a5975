// Replays simulated columns through each tracker, with some columns lost.
#pragma once

#include <array>
#include <random>

#include "core/tracking/methods/any_tracker.hpp"
#include "tests/honesty/pose_table.hpp"
#include "tests/honesty/two_band_calibration.hpp"
#include "tests/support/simulated_columns.hpp"

namespace tricoil::test {

enum class Method { direct, previous, scaat, dual_band };
constexpr std::array<Method, 3> kMethods{Method::direct, Method::previous, Method::scaat};  // of one band

inline const char* name_of(Method method) {
    constexpr std::array kNames{"direct", "previous", "scaat", "dual-band"};
    return kNames[static_cast<std::size_t>(method)];
}

inline const char* name_of(signal::Multiplexing mode) {
    constexpr std::array kNames{"tdm", "fdm", "dual_band"};
    return kNames[static_cast<std::size_t>(mode)];
}

/// Lost columns: a share of all, in bursts of consecutive columns.
struct Loss {
    double share = 0;
    int burst = 1;
};

inline tracking::MethodParams<double> params_of(Method method, const signal::AcquisitionPlan& plan) {
    const bool is_tdm = plan.is_tdm();
    switch (method) {
        case Method::direct:
            return tracking::DirectParams{is_tdm};
        case Method::previous: {
            tracking::PreviousParams previous;
            previous.deskew = is_tdm;
            return previous;
        }
        case Method::dual_band:
            return tracking::dual_band_params(plan.block_s());
        case Method::scaat:
            break;
    }
    return tracking::ScaatParams<double>{};
}

/// Scores every pose at its own time if the sensor is at 0.15 to 2 m. Poses before `settling_s` are not scored.
inline PoseRow replay_columns(const SimulatedColumns& run, Method method, Loss loss = {}, double settling_s = 0) {
    constexpr double kNearest_m = 0.15;
    constexpr double kFarthest_m = 2;
    const auto params = run.tracker_params(params_of(method, run.plan));
    const auto coils = method == Method::dual_band ? std::optional(two_band_calibration()) : std::nullopt;
    tracking::AnyTracker tracker(params, coils);
    std::mt19937 random(42);
    std::uniform_real_distribution<double> uniform(0, 1);
    PoseRow row;
    int lost = 0;
    for (const Column<double>& column : run.columns) {
        lost = lost > 0 ? lost - 1 : (uniform(random) < loss.share / loss.burst ? loss.burst : 0);
        const auto pose = lost > 0 ? tracker.tick(column.midpoint) : tracker.update(column);
        if (!pose || to_seconds(pose->time) < settling_s) {
            continue;
        }
        const sim::Pose truth = run.truth(pose->time);
        const double range_m = truth.position_m.norm();
        if (range_m > kNearest_m && range_m < kFarthest_m) {
            row.add(*pose, truth, params.common.max_deviation_m);
        }
    }
    return row;
}

}  // namespace tricoil::test
