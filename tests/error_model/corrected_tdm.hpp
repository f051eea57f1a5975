// Poses of a simulation with TDM, one a frame, with their motion error removed.
#pragma once

#include <cmath>
#include <vector>

#include "core/error_model/path_correction.hpp"
#include "tests/error_model/tdm_experiment.hpp"

namespace tricoil::paper {

struct CorrectedTdm {
    double given_rms_m = 0;
    double corrected_rms_m = 0;
    double corrected_rms_rad = 0;
    [[nodiscard]] double gain() const { return given_rms_m / corrected_rms_m; }
};

/// RMS of the errors of the poses that are not beside a part out of range, without and with the correction.
template <typename Scalar>
CorrectedTdm corrected_tdm(const sim::Motion& motion, const TdmParams& params) {
    using error_model::PathPose;
    std::vector<PathPose<Scalar>> given;
    std::vector<sim::Pose> truth;
    CorrectedTdm result;
    double count = 0;
    const auto finish_stretch = [&] {
        error_model::BudgetParams<Scalar> budget;
        budget.timing = error_model::tdm_timing<Scalar>(Scalar(params.slot_s), 0);
        std::vector<PathPose<Scalar>> corrected(given.size());
        error_model::correct_path<Scalar>(given, budget, corrected);
        for (std::size_t i = 1; i + 1 < given.size(); ++i) {
            const Vec3<double> true_m = truth[i].position_m;
            result.given_rms_m += (true_m - given[i].position_m.template cast<double>()).squaredNorm();
            result.corrected_rms_m += (true_m - corrected[i].position_m.template cast<double>()).squaredNorm();
            const double turn_rad =
                geometry::angle_between<double>(corrected[i].q_source_sensor.template cast<double>(), truth[i].q_source_sensor);
            result.corrected_rms_rad += turn_rad * turn_rad;
            count += 1;
        }
        given.clear();
        truth.clear();
    };
    const double frame_s = 3 * params.slot_s;
    double last_s = 0;
    for (const TdmPose& pose : simulate_tdm(motion, params)) {
        const auto slot = std::lround(pose.time_s / params.slot_s);
        if (slot % 3 != 2) {
            continue;
        }
        if (pose.time_s - last_s > 1.5 * frame_s) {
            finish_stretch();
        }
        last_s = pose.time_s;
        const sim::Pose real = motion.at(pose.time_s);
        const auto measured =
            error_model::corrected_pose<double>({pose.time_s, real.position_m, real.q_source_sensor}, -pose.measured);
        given.push_back(
            {Scalar(pose.time_s), measured.position_m.template cast<Scalar>(), measured.q_source_sensor.template cast<Scalar>()});
        truth.push_back(real);
    }
    finish_stretch();
    result.given_rms_m = std::sqrt(result.given_rms_m / count);
    result.corrected_rms_m = std::sqrt(result.corrected_rms_m / count);
    result.corrected_rms_rad = std::sqrt(result.corrected_rms_rad / count);
    return result;
}

}  // namespace tricoil::paper
