// Jumps of the azimuth error, simulated and predicted by beta - e_beta = +-(2n + 1) pi/2 (remark 2).
#pragma once

#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::paper {

/// A change of the azimuth error by more than this within one update is a jump. The largest true turn in the examples is 0.13 rad
/// per update (240 updates/s). Away from a pole the error changes by less than this limit per update.
constexpr double kJumpRad = 0.3;

struct SingularityReport {
    std::vector<double> predicted_s;  // times at which the model's beta - e_beta passes a pole
    std::vector<double> passages_s;   // times at which the measured elevation passes a pole
    std::vector<double> jumps_s;      // consecutive updates above kJumpRad count as one jump, at the largest change
    int hits = 0;                     // jumps within one update of a predicted passage
    int missed = 0;                   // jumps without such a passage
    int false_alarms = 0;             // predicted passages without a jump within one update
    double worst_distance_s = 0;      // over the hits, from the predicted instant to the update interval with the jump
};

SingularityReport compare_singularities(const std::vector<Update>& updates, double update_s);

}  // namespace tricoil::paper
