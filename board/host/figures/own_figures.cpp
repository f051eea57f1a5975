#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>

#include "board/host/figures/error_csv.hpp"
#include "board/host/figures/figures.hpp"
#include "board/support/errors.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "board/support/whole_file.hpp"
#include "core/base/angle_units.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/paper/paper_simulation.hpp"
#include "sim/paper/tdm_experiment.hpp"

namespace tricoil::host {
namespace {

using error_model::Loop;
namespace fs = std::filesystem;

struct LoopCase {
    const char* example;
    Loop loop;
    paper::Form form;
    int passes;
};

std::string write_case(const fs::path& folder, const std::string& name, const LoopCase& which, const InterruptGuard& guard) {
    guard.check();
    paper::SimulationParams params;
    params.loop = which.loop;
    params.form = which.form;
    params.passes = which.passes;
    write_whole_file(folder / name, error_csv(paper::simulate(paper::example(which.example), params)));
    return name;
}

Panel error_panel(const std::string& csv, const std::string& title, const char* label, const char* column) {
    const std::string predicted = fmt::format("predicted_{}", column);
    return {title,
            "Time (s)",
            label,
            {{csv, "time_s", column, "Measured", kMeasuredStyle},
             {csv, "time_s", predicted, "Calculated, exact κ", kCalculatedStyle}},
            ""};
}

Curve position_curve(const std::string& csv, const char* title, const char* style) {
    return {csv, "time_s", "(1000*column('position_error_m'))", title, style};
}

Panel position_panel(const std::string& title, std::vector<Curve> curves) {
    return {title, "Time (s)", "|position error| (mm)", std::move(curves),
            "set logscale y\nset yrange [1e-6:1e5]\nset format y '10^{%T}'"};
}

struct NamedMotion {
    std::string name;
    std::unique_ptr<sim::Motion> motion;
    double duration_s;
};

std::vector<NamedMotion> recorded_motions(const fs::path& recordings, const InterruptGuard& guard) {
    std::vector<fs::path> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(recordings, error)) {
        if (entry.path().extension() == ".traj") {
            files.push_back(entry.path());
        }
    }
    if (files.empty()) {
        throw InputError(fmt::format("no .traj files in {}; give another folder with --hand-motion", recordings.string()));
    }
    std::sort(files.begin(), files.end());
    std::vector<NamedMotion> motions;
    for (const fs::path& file : files) {
        guard.check();
        auto motion = std::make_unique<sim::RecordedMotion>(read_trajectory(file.string()), sim::RecordedMotionParams{});
        const double duration_s = motion->duration_s();
        motions.push_back({file.stem().string(), std::move(motion), duration_s});
    }
    return motions;
}

std::vector<NamedMotion> generated_motions() {
    std::vector<NamedMotion> motions;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        motions.push_back(
            {fmt::format("generated{}", seed), std::make_unique<sim::HandMotion>(Vec3<double>(0.9, 0, 0), seed), 5.0});
    }
    return motions;
}

void write_instants(const fs::path& file, const std::vector<paper::TdmPose>& poses) {
    std::string text = "time_s,measured_x_m,measured_y_m,measured_z_m,predicted_x_m,predicted_y_m,predicted_z_m\n";
    for (const paper::TdmPose& pose : poses) {
        fmt::format_to(std::back_inserter(text), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", pose.time_s,
                       pose.measured(0), pose.measured(1), pose.measured(2), pose.predicted(0), pose.predicted(1),
                       pose.predicted(2));
    }
    write_whole_file(file, text);
}

Panel scatter_panel(const char* title, const char* unit, const char* x, const char* y) {
    return {title,
            fmt::format("Simulated RMS ({})", unit),
            fmt::format("Predicted RMS ({})", unit),
            {{"budget.csv", x, y, "one motion", "points pt 7 ps 0.6 lc rgb '#cc0000'"},
             {"budget.csv", x, fmt::format("(column('{}'))", x), "equal", "lines lw 1 lc rgb 'black'"}},
            ""};
}

}  // namespace

Picture loop_figure(const fs::path& folder, const InterruptGuard& guard) {
    using paper::Form;
    const auto i_open = write_case(folder, "loop_I_open.csv", {"I", Loop::open, Form::angles, 1}, guard);
    const auto i_closed = write_case(folder, "loop_I_closed.csv", {"I", Loop::closed, Form::angles, 1}, guard);
    const auto ii_open = write_case(folder, "loop_II_open.csv", {"II", Loop::open, Form::angles, 1}, guard);
    const auto ii_closed = write_case(folder, "loop_II_closed.csv", {"II", Loop::closed, Form::angles, 1}, guard);
    const auto iii_open = write_case(folder, "loop_III_open.csv", {"III", Loop::open, Form::angles, 1}, guard);
    const auto iii_closed = write_case(folder, "loop_III_closed.csv", {"III", Loop::closed, Form::angles, 1}, guard);
    const auto iii_one = write_case(folder, "loop_III_closed_vectors_1.csv", {"III", Loop::closed, Form::vectors, 1}, guard);
    const auto iii_two = write_case(folder, "loop_III_closed_vectors_2.csv", {"III", Loop::closed, Form::vectors, 2}, guard);
    return {"loops.svg",
            {error_panel(i_open, "Example I, open loop", "{e_α}\u00a0(rad)", "e_alpha_rad"),
             error_panel(i_closed, "Example I, closed loop", "{e_α}\u00a0(rad)", "e_alpha_rad"),
             error_panel(ii_open, "Example II, open loop", "{e_β}\u00a0(rad)", "e_beta_rad"),
             error_panel(ii_closed, "Example II, closed loop", "{e_β}\u00a0(rad)", "e_beta_rad"),
             position_panel("Example III, open loop", {position_curve(iii_open, "angle form", kMeasuredStyle)}),
             position_panel("Example III, closed loop",
                            {position_curve(iii_closed, "angle form", kMeasuredStyle),
                             position_curve(iii_one, "pole-free", "lines lw 1.2 lc rgb '#0044cc'"),
                             position_curve(iii_two, "pole-free, 2 passes", "lines lw 1.2 lc rgb '#008844'")})},
            2,
            560,
            280};
}

Picture budget_figure(const fs::path& folder, const fs::path& recordings, const InterruptGuard& guard,
                      const ShowShare& progress) {
    const auto motions = recordings.empty() ? generated_motions() : recorded_motions(recordings, guard);
    std::string table =
        "motion,poses,measured_position_rms_mm,predicted_position_rms_mm,device_position_rms_mm,measured_rotation_rms_deg,"
        "predicted_rotation_rms_deg,device_rotation_rms_deg,position_correlation,rotation_correlation\n";
    for (std::size_t n = 0; n < motions.size(); ++n) {
        guard.check();
        progress(static_cast<double>(n) / static_cast<double>(motions.size()));
        paper::TdmParams params;
        params.duration_s = motions[n].duration_s;
        const auto poses = paper::simulate_tdm(*motions[n].motion, params);
        const auto r = paper::summarise(poses);
        fmt::format_to(std::back_inserter(table), "{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6f},{:.6f}\n",
                       motions[n].name, r.poses, 1e3 * r.measured_position_rms_m, 1e3 * r.predicted_position_rms_m,
                       1e3 * r.device_position_rms_m, kDegrees * r.measured_rotation_rms_rad,
                       kDegrees * r.predicted_rotation_rms_rad, kDegrees * r.device_rotation_rms_rad, r.position_correlation,
                       r.rotation_correlation);
        if (n == 0) {
            write_instants(folder / "budget_instants.csv", poses);
        }
    }
    write_whole_file(folder / "budget.csv", table);
    const std::string source = recordings.empty() ? "generated hand-like motions" : "recorded hand motions";
    Panel instants{fmt::format("First of the {}, z: direct solution of each column with the previous two", source),
                   "Time (s)",
                   "z error (mm)",
                   {{"budget_instants.csv", "time_s", "(1000*column('measured_z_m'))", "Simulated", kMeasuredStyle},
                    {"budget_instants.csv", "time_s", "(1000*column('predicted_z_m'))", "Predicted", kCalculatedStyle}},
                   "set xrange [0.5:0.6]"};
    return {
        "budget.svg",
        {scatter_panel("Position, TDM 240 Hz", "mm", "measured_position_rms_mm", "predicted_position_rms_mm"),
         scatter_panel("Orientation, TDM 240 Hz", "deg", "measured_rotation_rms_deg", "predicted_rotation_rms_deg"), instants},
        1,
        720,
        320};
}

}  // namespace tricoil::host
