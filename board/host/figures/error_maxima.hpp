// Largest measured and predicted errors of a simulated motion.
#pragma once

#include <vector>

#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {

/// Angles without whole turns, as the paper shows them.
struct ErrorMaxima {
    double max_abs_e_rho_m = 0;
    double max_abs_e_alpha_rad = 0;
    double max_abs_e_beta_rad = 0;
    double final_e_beta_rad = 0;
};

/// Largest differences, whole turns included.
struct WorstDifference {
    double e_rho_m = 0;
    double e_alpha_rad = 0;
    double e_beta_rad = 0;
};

struct Summary {
    ErrorMaxima measured;
    ErrorMaxima predicted;
    ErrorMaxima exact;  // chained exact steps
    WorstDifference worst_prediction;
    WorstDifference worst_exact;
    double max_position_error_m = 0;
    double predicted_max_position_error_m = 0;
    double max_rotation_error_rad = 0;
};

Summary summarise(const std::vector<paper::Update>& updates);

}  // namespace tricoil::host
