// Error budget compared with simulation: a motion sampled by time-division multiplexing, solved as if sampled at one instant.
#pragma once

#include <vector>

#include "core/error_model/error_budget.hpp"
#include "sim/motion/motion.hpp"

namespace tricoil::paper {

struct TdmParams {
    double slot_s = 1.0 / 720;
    double settle_s = 0.5;      // time at the beginning that is not scored
    double duration_s = 0;      // of the motion
    double min_range_m = 0.15;  // poses outside this range are not scored
    double max_range_m = 2;
};

/// One pose, at the time of its last column. Errors are true minus measured, source frame.
struct TdmPose {
    double time_s = 0;
    error_model::PoseError<double> measured;
    error_model::PoseError<double> predicted;            // from the true motion
    error_model::PoseError<double> predicted_by_device;  // from the differences of the device's own poses
};

/// One pose per column, by the direct solver on the latest three columns, without noise. Throws std::invalid_argument if no pose
/// is scored: the motion is too short or never within range.
std::vector<TdmPose> simulate_tdm(const sim::Motion& motion, const TdmParams& params);

/// Rates and accelerations of a motion by central differences.
error_model::MotionState<double> motion_state(const sim::Motion& motion, double time_s);

}  // namespace tricoil::paper
