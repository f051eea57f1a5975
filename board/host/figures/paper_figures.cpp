#include "board/host/figures/error_csv.hpp"
#include "board/host/figures/figures.hpp"
#include "sim/paper/paper_simulation.hpp"

namespace tricoil::host {
namespace {

using error_model::KappaForm;
using error_model::Loop;
using paper::Form;

struct Simulation {
    const char* file;
    const char* example;
    paper::SimulationParams params;
    double attitude_factor = 1;
};

/// Equations of the paper's figures: range (37) and elevation (28) with kappa of (29), azimuth (35) with kappa = 2.
constexpr paper::SimulationParams kAsPlotted{.kappa = KappaForm::paper, .azimuth_kappa = KappaForm::two};
constexpr paper::SimulationParams kClosed{.loop = Loop::closed};
constexpr double kChanged = 1 + 1e-13;  // Fig. 5 is chaotic

constexpr Simulation kSimulations[] = {
    {"fig1.csv", "I", kAsPlotted},
    {"fig2.csv", "II", kAsPlotted},
    {"fig2_kappa_2.csv", "II", {.kappa = KappaForm::two}},
    {"fig3.csv", "III", kAsPlotted},
    {"fig4.csv", "III", kAsPlotted},
    {"fig5.csv", "orientation", kAsPlotted},
    {"fig5_changed.csv", "orientation", kAsPlotted, kChanged},
    {"fig6.csv", "IIIo", kAsPlotted},
    {"loop_I_open.csv", "I", {}},
    {"loop_I_closed.csv", "I", kClosed},
    {"loop_II_open.csv", "II", {}},
    {"loop_II_closed.csv", "II", kClosed},
    {"loop_III_open.csv", "III", {}},
    {"loop_III_closed.csv", "III", kClosed},
    {"loop_III_closed_vectors_1.csv", "III", {.loop = Loop::closed, .form = Form::vectors}},
    {"loop_III_closed_vectors_2.csv", "III", {.loop = Loop::closed, .form = Form::vectors, .passes = 2}},
};

}  // namespace

void write_paper_figures(const std::filesystem::path& folder, const InterruptGuard& guard) {
    for (const Simulation& simulation : kSimulations) {
        guard.check();
        paper::Example example = paper::example(simulation.example);
        example.attitude.amplitude *= simulation.attitude_factor;
        write_error_csv(folder / simulation.file, paper::simulate(example, simulation.params));
    }
}

}  // namespace tricoil::host
