#include "board/host/figures/error_csv.hpp"
#include "board/host/figures/figures.hpp"
#include "board/support/whole_file.hpp"
#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {
namespace {

// Labels have a no-break space before the unit, because gnuplot drops a plain space after a subscript.
constexpr const char* kTime = "time_s";
constexpr const char* kBlue = "lines lw 1.2 lc rgb '#0044cc'";

constexpr double kSmallChange = 1e-13;  // relative, of a rate: Fig. 5 is chaotic

/// Equations of the paper's figures: range (37) and elevation (28) with kappa of (29), azimuth (35) with kappa = 2.
std::vector<paper::Update> simulate_as_plotted(const paper::Example& example) {
    paper::SimulationParams params;
    params.kappa = error_model::KappaForm::paper;
    params.azimuth_kappa = error_model::KappaForm::two;
    return paper::simulate(example, params);
}

std::vector<paper::Update> simulate_with_kappa_2(const paper::Example& example) {
    paper::SimulationParams params;
    params.kappa = error_model::KappaForm::two;
    return paper::simulate(example, params);
}

paper::Example with_changed_rate(paper::Example example) {
    example.attitude.amplitude *= 1 + kSmallChange;
    return example;
}

/// Writes CSV files of simulations to one folder; each call returns the file's name.
class Writer {
public:
    Writer(const std::filesystem::path& folder, const InterruptGuard& guard) : folder_(folder), guard_(guard) {}

    std::string errors(const std::string& name, const paper::Example& example) {
        return write(name, error_csv(simulate_as_plotted(example)));
    }
    std::string errors_with_kappa_2(const std::string& name, const paper::Example& example) {
        return write(name, error_csv(simulate_with_kappa_2(example)));
    }
    std::string azimuth_rate(const std::string& name, const paper::Example& example) {
        return write(name, azimuth_rate_csv(simulate_as_plotted(example)));
    }

private:
    std::string write(const std::string& name, const std::string& text) {
        guard_.check();
        write_whole_file(folder_ / name, text);
        return name;
    }

    const std::filesystem::path& folder_;
    const InterruptGuard& guard_;
};

Panel compare(const std::string& csv, const char* title, const char* label, const std::string& measured,
              const std::string& predicted, const char* style = kMeasuredStyle) {
    return {title,
            "Time (s)",
            label,
            {{csv, kTime, measured, "Measured", style}, {csv, kTime, predicted, "Calculated", kCalculatedStyle}},
            ""};
}

/// Two runs: the orientation errors are chaotic.
Panel orientation_panel(const std::string& csv, const std::string& changed_csv, const char* title, const char* label,
                        const std::string& column) {
    return {
        title,
        "Time (s)",
        label,
        {{csv, kTime, column, "Measured", kMeasuredStyle}, {changed_csv, kTime, column, "Rates 1e-13 larger", kCalculatedStyle}},
        ""};
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

/// Also shows the calculation with kappa = 2, which Fig. 2(b) most likely shows: the paper's two curves differ, ours do not.
Panel elevation_panel_of_fig2(const std::string& csv, const std::string& kappa_2_csv) {
    Panel panel = elevation_panel(csv, "(b) Elevation error");
    panel.curves.push_back({kappa_2_csv, kTime, "predicted_e_beta_rad", "Calculated, κ = 2", kBlue});
    return panel;
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
    Writer writer(folder, guard);
    const auto one = writer.errors("fig1.csv", paper::example("I"));
    const auto two = writer.errors("fig2.csv", paper::example("II"));
    const auto two_kappa_2 = writer.errors_with_kappa_2("fig2_kappa_2.csv", paper::example("II"));
    const auto three = writer.errors("fig3.csv", paper::example("III"));
    const auto four = writer.azimuth_rate("fig4.csv", paper::example("III"));
    const auto five = writer.errors("fig5.csv", paper::example("orientation"));
    const auto five_changed = writer.errors("fig5_changed.csv", with_changed_rate(paper::example("orientation")));
    const auto six = writer.errors("fig6.csv", paper::example("IIIo"));
    // Close to a pole the rate exceeds 10,000 rad/s. The axis is limited, so that the other values are visible.
    Panel rate = compare(four, "Error of the azimuth rate, example III", "{e_{dα/dt}}\u00a0(rad/s)", "e_alpha_rate_rad_s",
                         "predicted_e_alpha_rate_rad_s");
    rate.settings = "set yrange [-2000:2000]";
    return {
        {"fig1.svg", {range_panel(one), azimuth_panel(one)}},
        {"fig2.svg", {range_panel(two), elevation_panel_of_fig2(two, two_kappa_2)}},
        {"fig3.svg", {range_panel(three), azimuth_panel(three), elevation_panel(three, "(c) Elevation error")}},
        {"fig4.svg", {rate}, 1, 720, 360},
        {"fig5.svg",
         {orientation_panel(five, five_changed, "(a) Orientation: azimuth error", "{e_ψ}\u00a0(rad)", "e_psi_rad"),
          orientation_panel(five, five_changed, "(b) Orientation: elevation error", "{e_θ}\u00a0(rad)", "e_theta_rad"),
          orientation_panel(five, five_changed, "(c) Orientation: roll error", "{e_φ}\u00a0(rad)", "e_phi_rad")}},
        {"fig6.svg",
         {range_panel(six, kBlue), azimuth_panel_of_fig6(six, three), elevation_panel(six, "(c) Elevation error", kBlue)}},
    };
}

}  // namespace tricoil::host
