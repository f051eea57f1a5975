// tricoil motion: the movement-induced error model against simulation, for the paper's examples or own rates. Recorded poses: in
// Python.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/reader_options.hpp"
#include "board/host/figures/error_csv.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/progress.hpp"
#include "board/support/terminal_text.hpp"
#include "core/error_model/board_timing.hpp"
#include "core/error_model/whole_turns.hpp"
#include "sim/paper/paper_simulation.hpp"
#include "sim/paper/singularities.hpp"

namespace tricoil::host {
namespace {

using paper::Update;

const std::vector<std::string> kLoops{"open", "closed"};
const std::vector<std::string> kKappas{"exact", "paper", "two"};
const std::vector<std::string> kForms{"angles", "vectors"};

struct MotionCommand {
    std::string example;
    std::string loop = "open";
    std::string kappa = "exact";
    std::string form = "angles";
    std::vector<double> azimuth, elevation, range, attitude;  // A, B of (40)
    int passes = 1;
    std::vector<double> rate_hz{240};
    double gap_s = 0;
    double duration_s = 10;
    double start_range_m = 0.5;
    double start_time_s = 0;
    std::string out;
    bool json = false;
};

struct MotionResult {
    paper::Example example;
    paper::SimulationParams params;
    std::vector<Update> updates;
    paper::SingularityReport singularities;
};

bool has_own_rates(const MotionCommand& c) {
    return !(c.azimuth.empty() && c.elevation.empty() && c.range.empty() && c.attitude.empty());
}

void check_option(const char* option, double value, double least, double largest) {
    refuse_if(!(value >= least && value <= largest), "{} must be {} to {}; got {}", option, least, largest, value);
}

paper::Example make_example(const MotionCommand& c) {
    refuse_if(c.example.empty() && !has_own_rates(c),
              "motion needs --example I|II|III|orientation|IIIo or own rates: --azimuth, --elevation, --range, --attitude");
    paper::Example example;
    example.name = "own rates";
    if (!c.example.empty()) {
        example = paper::example(paper::example_names()[index_of_name("example", c.example, paper::example_names())]);
    }
    const auto set = [](const std::vector<double>& ab, paper::Rate& rate) {
        rate = ab.empty() ? rate : paper::paper_angle_rate(ab[0], ab[1]);
    };
    set(c.azimuth, example.azimuth);
    set(c.elevation, example.elevation);
    set(c.attitude, example.attitude);
    if (!c.range.empty()) {
        example.range = {c.range[1], c.range[0], 10 * std::numbers::pi};  // (40): the range's frequency is fixed
    }
    check_option("--start-range", c.start_range_m, paper::kMinStartRange, paper::kMaxStartRange);
    example.start.range_m = c.start_range_m;
    return example;
}

paper::SimulationParams make_params(const MotionCommand& c) {
    refuse_if(c.rate_hz.size() > 1, "--rate-hz A,B requires --poses or --trajectory; give one number");
    check_option("--rate-hz", c.rate_hz.front(), 1, 1e5);
    check_option("--gap", c.gap_s, 0, 1);
    check_option("--start-time", c.start_time_s, 0, 1e9);
    paper::SimulationParams params;
    params.loop = static_cast<error_model::Loop>(index_of_name("loop", c.loop, kLoops));
    params.kappa = static_cast<error_model::KappaForm>(index_of_name("kappa", c.kappa, kKappas));
    params.form = static_cast<paper::Form>(index_of_name("form", c.form, kForms));
    params.passes = c.passes;
    params.update_s = error_model::effective_update_time(1 / c.rate_hz.front(), 0.0, c.gap_s);
    params.duration_s = c.duration_s;
    params.start = DeviceTime{microseconds_from_seconds(c.start_time_s)};
    return params;
}

/// Errors of which an update has several: `part` selects one, with range_m, azimuth_rad and elevation_rad.
using Angles = geometry::Spherical<double> (*)(const Update& update);
geometry::Spherical<double> measured(const Update& u) { return u.measured.position; }
geometry::Spherical<double> predicted(const Update& u) {
    return {u.predicted.range_m, u.predicted.azimuth_rad, u.predicted.elevation_rad};
}
geometry::Spherical<double> exact(const Update& u) { return u.exact.position; }

template <typename Value>
double largest(const std::vector<Update>& updates, Value value) {
    double most = 0;
    for (const Update& update : updates) {
        most = std::max(most, std::abs(value(update)));
    }
    return most;
}

/// Angles without whole turns, as the paper shows them.
Json maxima(const std::vector<Update>& updates, Angles part) {
    using error_model::without_whole_turns;
    return {{"max_abs_e_rho_m", largest(updates, [&](const Update& u) { return part(u).range_m; })},
            {"max_abs_e_alpha_rad", largest(updates, [&](const Update& u) { return without_whole_turns(part(u).azimuth_rad); })},
            {"max_abs_e_beta_rad", largest(updates, [&](const Update& u) { return without_whole_turns(part(u).elevation_rad); })},
            {"final_e_beta_rad", without_whole_turns(part(updates.back()).elevation_rad)}};
}

/// Largest differences from the measured errors, whole turns included.
Json worst(const std::vector<Update>& updates, Angles part) {
    const auto apart = [&](double geometry::Spherical<double>::*of) {
        return largest(updates, [&](const Update& u) { return part(u).*of - measured(u).*of; });
    };
    using Spherical = geometry::Spherical<double>;
    return {{"e_rho_m", apart(&Spherical::range_m)},
            {"e_alpha_rad", apart(&Spherical::azimuth_rad)},
            {"e_beta_rad", apart(&Spherical::elevation_rad)}};
}

/// Singular instants are predicted for the angle form with one pass; the pole-free form has none.
bool has_poles(const paper::SimulationParams& params) {
    return params.form == paper::Form::angles && paper::has_prediction(params);
}

Json json_of(const MotionResult& r) {
    Json json = {{"example", r.example.name},
                 {"loop", kLoops[static_cast<std::size_t>(r.params.loop)]},
                 {"kappa", kKappas[static_cast<std::size_t>(r.params.kappa)]},
                 {"form", kForms[static_cast<std::size_t>(r.params.form)]},
                 {"passes", r.params.passes},
                 {"update_s", r.params.update_s},
                 {"updates", r.updates.size() - 1},
                 {"measured", maxima(r.updates, measured)}};
    if (paper::has_prediction(r.params)) {
        json["predicted"] = maxima(r.updates, predicted);
        json["max_abs_predicted_minus_measured"] = worst(r.updates, predicted);
    }
    if (paper::has_exact_chain(r.params)) {
        json["exact_step"] = maxima(r.updates, exact);
        json["max_abs_exact_step_minus_measured"] = worst(r.updates, exact);
    }
    json["max_position_error_m"] = largest(r.updates, [](const Update& u) { return u.position_error_m.norm(); });
    if (paper::has_prediction(r.params)) {
        json["predicted_max_position_error_m"] =
            largest(r.updates, [](const Update& u) { return u.predicted_position_error_m.norm(); });
    }
    json["max_orientation_error_rad"] = largest(r.updates, [](const Update& u) { return u.rotation_error_rad; });
    if (!has_poles(r.params)) {
        return json;
    }
    json["singularities"] = {{"predicted", r.singularities.predicted_s.size()},
                             {"measured_passages", r.singularities.passages_s.size()},
                             {"measured_jumps", r.singularities.jumps_s.size()},
                             {"hits", r.singularities.hits},
                             {"missed", r.singularities.missed},
                             {"false_alarms", r.singularities.false_alarms},
                             {"worst_hit_distance_s", r.singularities.worst_distance_s},
                             {"predicted_s", r.singularities.predicted_s},
                             {"jumps_s", r.singularities.jumps_s}};
    return json;
}

std::string motion_text(const Json& r) {
    const bool has_prediction = r.contains("predicted");
    const auto row = [&](const char* name, const char* key) {
        constexpr const char* kRow =
            " {max_abs_e_rho_m:>14.9f} {max_abs_e_alpha_rad:>14.9f} {max_abs_e_beta_rad:>14.9f} {final_e_beta_rad:>14.9f}\n";
        return r.contains(key) ? fmt::format("  {:<12}", name) + fill(r[key], kRow) : "";
    };
    std::string text = fill(r, "{example}, {loop} loop, {form} form, {updates} updates of {update_s:.6f} s");
    text += r["passes"] > 1 ? fill(r, ", {passes} passes") : "";
    text += has_prediction ? fill(r, "; prediction with kappa {kappa}\n")
                           : "; no prediction for more than one pass of the angle form\n";
    text += "                 max|e_rho| m   max|e_alpha| max|e_beta| rad   final e_beta\n";
    text += row("measured", "measured") + row("predicted", "predicted") + row("exact steps", "exact_step");
    if (has_prediction) {
        text += fill(r["max_abs_predicted_minus_measured"],
                     "predicted minus measured, at most: e_rho {e_rho_m:.2e} m, e_alpha {e_alpha_rad:.2e} rad, "
                     "e_beta {e_beta_rad:.2e} rad\n");
    }
    text += fill(r, "position error at most {max_position_error_m in mm:.6g} mm");
    text += has_prediction ? fill(r, " (predicted {predicted_max_position_error_m in mm:.6g})") : "";
    text += fill(r, ", orientation error at most {max_orientation_error_rad in deg:.6g} deg\n");
    if (r.contains("singularities")) {
        text += fill(r["singularities"],
                     "singular instants: {predicted} predicted; {measured_jumps} jumps of the azimuth error: {hits} predicted, "
                     "{missed} missed, {false_alarms} false alarms\n");
    }
    return text;
}

int motion(const MotionCommand& command) {
    MotionResult result;
    result.example = make_example(command);
    result.params = make_params(command);
    Progress progress("motion");
    const double updates = result.params.duration_s / result.params.update_s;
    double done = 0;
    result.updates = paper::simulate(result.example, result.params, [&](const Update&) { progress.show(++done / updates); });
    if (has_poles(result.params)) {
        result.singularities = paper::compare_singularities(result.updates, result.params.update_s);
    }
    if (!command.out.empty()) {
        write_error_csv(command.out, result.updates);
    }
    print_result(json_of(result), command.json, motion_text);
    return to_int(ExitCode::fine);
}

// Names of options that Python reads.
struct PythonOptions {
    std::vector<std::string> recorded, reader, plan;
};

int motion_of(const MotionCommand& command, const PythonOptions& python, const CLI::App& sub) {
    const bool is_recorded = sub.count("--poses") + sub.count("--trajectory") > 0;
    const bool is_plan = sub.count("--plan") > 0;
    const auto require = [&](const std::vector<std::string>& options, bool is_given, const char* other) {
        for (const std::string& option : options) {
            refuse_if(!is_given && option != "--rate-hz" && sub.count(option) > 0, "{} requires {}", option, other);
        }
    };
    require(python.recorded, is_recorded, "--poses or --trajectory");
    require(python.reader, is_recorded, "--poses or --trajectory");
    require(python.plan, is_plan, "--plan");
    return is_recorded || is_plan ? continue_in_python(sub) : motion(command);
}

}  // namespace

void add_motion_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<MotionCommand>();
    one_of(sub->add_option("--example", c->example, "Example of the paper"), paper::example_names());
    one_of(sub->add_option("--loop", c->loop, "open (as in the paper) or closed (as in a device)"), kLoops)
        ->capture_default_str();
    one_of(sub->add_option("--kappa", c->kappa, "kappa of the prediction"), kKappas)->capture_default_str();
    one_of(sub->add_option("--form", c->form, "angles (as in the paper) or vectors (pole-free, closed loop only)"), kForms)
        ->capture_default_str();
    sub->add_option("--passes", c->passes, "Passes of the previous-measurement step per update")->capture_default_str();
    const auto add_rate = [&](const char* name, std::vector<double>& rate, const char* what) {
        numbers(sub->add_option(name, rate, what), "A,B", 2);
    };
    add_rate("--azimuth", c->azimuth, "Azimuth rate B + A sin(A t), rad/s");
    add_rate("--elevation", c->elevation, "Elevation rate B + A sin(A t), rad/s");
    add_rate("--attitude", c->attitude, "Rate of psi, theta and phi, B + A sin(A t), rad/s");
    add_rate("--range", c->range, "Range rate B + A sin(10 pi t), m/s");
    sub->add_option("--start-range", c->start_range_m, "Range at the start, m")->capture_default_str();
    sub->add_option("--start-time", c->start_time_s, "Device time at the start, s")->capture_default_str();
    numbers(sub->add_option("--rate-hz", c->rate_hz, "Updates per second; with a file that has no times: its poses per second"),
            "A,B", 2)
        ->expected(1, 2)
        ->default_str("240");
    sub->add_option("--gap", c->gap_s, "Processing and multiplexing gap that lengthens each update, s")->capture_default_str();
    sub->add_option("--duration", c->duration_s, "Duration, s")->capture_default_str();
    file_name(
        sub->add_option("--out", c->out, "All updates as CSV, - is standard output; of --poses: the poses without motion error"));
    PythonOptions python;
    python.recorded = add_python_options(sub, "recorded");
    python.reader = add_reader_options(sub, "POSES,REFERENCE");
    python.plan = add_python_options(sub, "plan");
    sub->add_flag("--smooth")->description("--poses: smooth the poses in --out");
    sub->add_flag("--json", c->json, "Result as JSON");
    set_examples(sub, {{"example III of the paper, in a closed loop", "tricoil motion --example III --loop closed"},
                       {"an elevation rate of 2 rad/s", "tricoil motion --elevation 0,2 --duration 2"},
                       {"recorded poses of a LIBERTY", "tricoil motion --poses poses.csv --timing liberty --out corrected.csv"},
                       {"a path for a robot", "tricoil motion --plan plan.csv --limits 0.5,5,50"}});
    sub->callback([=, &action] { action = [=] { return motion_of(*c, python, *sub); }; });
}

}  // namespace tricoil::host
