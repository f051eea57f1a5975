// Compares every pose of a simulated run with the true pose at its midpoint time.
#pragma once

#include <vector>

#include "board/support/statistics.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/motion/motion.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::host {

/// Error of one pose, with the true pose.
struct PoseError {
    sim::Pose truth;
    double time_s = 0;  // since the run began
    double position_m = 0;
    double orientation_rad = 0;
};

struct ScoreSummary {
    ErrorSummary position_m;
    ErrorSummary orientation_rad;
    double bound_position_m = 0;  // RMS of the Cramer-Rao bound of simultaneous columns, with the window's motion blur
    double bound_orientation_rad = 0;
    double blur_position_m = 0;       // RMS of the blur alone
    double predicted_position_m = 0;  // RMS of the errors that the poses predict
    double predicted_orientation_rad = 0;
    double expected_position_m = 0;  // RMS of the stated deviations
    double expected_orientation_rad = 0;
    double snr_db = 0;  // 20 log10(k / sigma), mean over the poses for which a bound is computed
    std::size_t scored = 0;
    std::size_t invalid = 0;       // after the settling time, left out
    std::size_t out_of_range = 0;  // truth outside the scored range, left out
    std::size_t distorted = 0;     // scored, but flagged
};

/// Ignores poses of the first half second. Counts invalid poses and poses outside 0.15 to 2 m, and scores all others.
class RunScore {
public:
    /// poses_per_bound: N computes the Cramer-Rao bound for every Nth scored pose.
    RunScore(const sim::Motion& motion, const sim::CoilWorld& world, const sim::SimulatedClock& clock,
             const signal::AcquisitionPlan& plan, int poses_per_bound = 1);

    /// Returns the error of one estimate, and scores it if it qualifies.
    PoseError add(const tracking::PoseEstimate<double>& estimate);

    [[nodiscard]] ScoreSummary summary() const;

private:
    void add_bound(const PoseError& error);
    void add_prediction(const error_model::ErrorTerm<double>& total);

    const sim::Motion& motion_;
    const sim::CoilWorld& world_;
    const sim::SimulatedClock& clock_;
    double window_s_;
    std::vector<double> position_m_;
    std::vector<double> orientation_rad_;
    std::size_t poses_per_bound_;
    std::size_t bounds_ = 0;
    std::size_t predictions_ = 0;
    ScoreSummary totals_;  // counts, and sums of squared bounds
};

}  // namespace tricoil::host
