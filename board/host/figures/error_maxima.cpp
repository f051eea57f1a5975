#include "board/host/figures/error_maxima.hpp"

#include <algorithm>
#include <cmath>

#include "core/error_model/whole_turns.hpp"

namespace tricoil::host {
namespace {

using error_model::without_whole_turns;

/// `Errors` has the members range_m, azimuth_rad and elevation_rad.
template <typename Errors>
void include(ErrorMaxima& maxima, const Errors& e) {
    maxima.max_abs_e_rho_m = std::max(maxima.max_abs_e_rho_m, std::abs(e.range_m));
    maxima.max_abs_e_alpha_rad = std::max(maxima.max_abs_e_alpha_rad, std::abs(without_whole_turns(e.azimuth_rad)));
    maxima.max_abs_e_beta_rad = std::max(maxima.max_abs_e_beta_rad, std::abs(without_whole_turns(e.elevation_rad)));
    maxima.final_e_beta_rad = without_whole_turns(e.elevation_rad);
}

template <typename Errors>
void include(WorstDifference& worst, const Errors& a, const geometry::Spherical<double>& b) {
    worst.e_rho_m = std::max(worst.e_rho_m, std::abs(a.range_m - b.range_m));
    worst.e_alpha_rad = std::max(worst.e_alpha_rad, std::abs(a.azimuth_rad - b.azimuth_rad));
    worst.e_beta_rad = std::max(worst.e_beta_rad, std::abs(a.elevation_rad - b.elevation_rad));
}

}  // namespace

Summary summarise(const std::vector<paper::Update>& updates) {
    Summary summary;
    for (const paper::Update& update : updates) {
        include(summary.measured, update.measured.position);
        include(summary.predicted, update.predicted);
        include(summary.exact, update.exact.position);
        include(summary.worst_prediction, update.predicted, update.measured.position);
        include(summary.worst_exact, update.exact.position, update.measured.position);
        summary.max_position_error_m = std::max(summary.max_position_error_m, update.position_error_m.norm());
        summary.predicted_max_position_error_m =
            std::max(summary.predicted_max_position_error_m, update.predicted_position_error_m.norm());
        summary.max_rotation_error_rad = std::max(summary.max_rotation_error_rad, update.rotation_error_rad);
    }
    return summary;
}

}  // namespace tricoil::host
