#include "board/host/figures/error_csv.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "board/support/output_file.hpp"
#include "core/error_model/whole_turns.hpp"

namespace tricoil::host {
namespace {

/// Number as text; empty for NaN (no prediction).
std::string number(double value) { return std::isnan(value) ? "" : fmt::format("{:.12g}", value); }

}  // namespace

void write_error_csv(const std::string& path, const std::vector<paper::Update>& updates) {
    using error_model::without_whole_turns;
    std::string text =
        "time_s,stamp_us,e_rho_m,e_alpha_rad,e_beta_rad,predicted_e_rho_m,predicted_e_alpha_rad,predicted_e_beta_rad,"
        "e_alpha_rate_rad_s,predicted_e_alpha_rate_rad_s,e_psi_rad,e_theta_rad,e_phi_rad,position_error_m,rotation_error_rad\n";
    for (const paper::Update& u : updates) {
        const auto& [position, attitude] = u.measured;
        fmt::format_to(std::back_inserter(text), "{:.9g},{},{:.12g},{:.12g},{:.12g},{},{},{},{:.9g},{},", u.time_s,
                       to_us(u.stamp), position.range_m, without_whole_turns(position.azimuth_rad),
                       without_whole_turns(position.elevation_rad), number(u.predicted.range_m),
                       number(without_whole_turns(u.predicted.azimuth_rad)),
                       number(without_whole_turns(u.predicted.elevation_rad)), u.measured_azimuth_rate_error_rad_s,
                       number(u.predicted_azimuth_rate_error_rad_s));
        fmt::format_to(std::back_inserter(text), "{:.12g},{:.12g},{:.12g},{:.9g},{:.9g}\n",
                       without_whole_turns(attitude.azimuth_rad), without_whole_turns(attitude.elevation_rad),
                       without_whole_turns(attitude.roll_rad), u.position_error_m.norm(), u.rotation_error_rad);
    }
    write_whole_file(path, text);
}

}  // namespace tricoil::host
