// Jumps of the azimuth error, simulated and predicted by beta - e_beta = +-(2n + 1) pi/2 (remark 2).
#pragma once

#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::paper {

/// A change of the azimuth error by more than this within one update is a jump. The largest true turn in the examples is 0.26 rad
/// per update, and no error grows faster than that away from a pole.
constexpr double kJumpRad = 0.3;

struct SingularityReport {
    std::vector<double> predicted_s;  // times at which the model's beta - e_beta passes a pole
    std::vector<double> passages_s;   // times at which the measured elevation passes a pole
    std::vector<double> jumps_s;      // a run of updates above kJumpRad counts as one jump, at its largest change
    int hits = 0;                     // jumps within one update of a predicted passage
    int missed = 0;                   // jumps without a prediction nearby
    int false_alarms = 0;             // predictions without a jump nearby
    double worst_distance_s = 0;      // over the hits, from the predicted instant to the update with the jump
};

SingularityReport compare_singularities(const std::vector<Update>& updates, double update_s);

}  // namespace tricoil::paper
