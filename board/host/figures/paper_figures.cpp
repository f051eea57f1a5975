#include "board/host/figures/error_csv.hpp"
#include "board/host/figures/figures.hpp"
#include "board/support/whole_file.hpp"
#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {
namespace {

// Labels have a no-break space before the unit, because gnuplot drops a plain space after a subscript.
constexpr const char* kTime = "time_s";
constexpr const char* kBlue = "lines lw 1.2 lc rgb '#0044cc'";

/// Equations of the paper's figures: range (37) and elevation (28) with kappa of (29), azimuth (35) with kappa = 2.
std::vector<paper::Update> simulate_as_plotted(const char* example) {
    paper::SimulationParams params;
    params.kappa = error_model::KappaForm::paper;
    params.azimuth_kappa = error_model::KappaForm::two;
    return paper::simulate(paper::example(example), params);
}

std::string write(const std::filesystem::path& folder, const std::string& name, const char* example,
                  const InterruptGuard& guard) {
    guard.check();
    write_whole_file(folder / name, error_csv(simulate_as_plotted(example)));
    return name;
}

Panel compare(const std::string& csv, const char* title, const char* label, const std::string& measured,
              const std::string& predicted, const char* style = kMeasuredStyle) {
    return {title,
            "Time (s)",
            label,
            {{csv, kTime, measured, "Measured", style}, {csv, kTime, predicted, "Calculated", kCalculatedStyle}},
            ""};
}

Panel measured_only(const std::string& csv, const char* title, const char* label, const std::string& column) {
    return {title, "Time (s)", label, {{csv, kTime, column, "Measured", kMeasuredStyle}}, ""};
}

Panel range_panel(const std::string& csv, const char* style = kMeasuredStyle) {
    return compare(csv, "(a) Range error", "{e_ρ}\u00a0(m)", "e_rho_m", "predicted_e_rho_m", style);
}

Panel azimuth_panel(const std::string& csv, const char* style = kMeasuredStyle) {
    return compare(csv, "(b) Azimuth error", "{e_α}\u00a0(rad)", "e_alpha_rad", "predicted_e_alpha_rad", style);
}

Panel elevation_panel(const std::string& csv, const char* title, const char* style = kMeasuredStyle) {
    return compare(csv, title, "{e_β}\u00a0(rad)", "e_beta_rad", "predicted_e_beta_rad", style);
}

/// Also shows the measured error at fixed orientation of Fig. 3(b), in red.
Panel azimuth_panel_of_fig6(const std::string& csv, const std::string& fixed_csv) {
    Panel panel = azimuth_panel(csv, kBlue);
    panel.curves[0].title = "Measured, varying orientation";
    panel.curves.push_back({fixed_csv, kTime, "e_alpha_rad", "Measured, fixed orientation", kMeasuredStyle});
    return panel;
}

}  // namespace

std::vector<Picture> paper_figures(const std::filesystem::path& folder, const InterruptGuard& guard) {
    const auto one = write(folder, "fig1.csv", "I", guard);
    const auto two = write(folder, "fig2.csv", "II", guard);
    const auto three = write(folder, "fig3.csv", "III", guard);
    const auto five = write(folder, "fig5.csv", "orientation", guard);
    const auto six = write(folder, "fig6.csv", "IIIo", guard);
    // Close to a pole the rate exceeds 10,000 rad/s. The axis is limited, so that the other values are visible.
    Panel rate = compare(three, "Error of the azimuth rate, example III", "{e_{dα/dt}}\u00a0(rad/s)", "e_alpha_rate_rad_s",
                         "predicted_e_alpha_rate_rad_s");
    rate.settings = "set yrange [-2000:2000]";
    return {
        {"fig1.svg", {range_panel(one), azimuth_panel(one)}},
        {"fig2.svg", {range_panel(two), elevation_panel(two, "(b) Elevation error")}},
        {"fig3.svg", {range_panel(three), azimuth_panel(three), elevation_panel(three, "(c) Elevation error")}},
        {"fig4.svg", {rate}, 1, 720, 360},
        {"fig5.svg",
         {measured_only(five, "(a) Orientation: azimuth error", "{e_ψ}\u00a0(rad)", "e_psi_rad"),
          measured_only(five, "(b) Orientation: elevation error", "{e_θ}\u00a0(rad)", "e_theta_rad"),
          measured_only(five, "(c) Orientation: roll error", "{e_φ}\u00a0(rad)", "e_phi_rad")}},
        {"fig6.svg",
         {range_panel(six, kBlue), azimuth_panel_of_fig6(six, three), elevation_panel(six, "(c) Elevation error", kBlue)}},
    };
}

}  // namespace tricoil::host
