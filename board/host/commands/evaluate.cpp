// tricoil evaluate: pose errors of a calibrated tracker against ground truth.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <numeric>

#include "board/command_line/option_words.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/error_map.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/reader_options.hpp"
#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

const std::vector<std::string> kSolvers{"direct", "refined"};

struct EvaluateCommand {
    std::string calibration;
    std::string wiring;
    std::vector<std::string> data;
    std::string solver = "refined";
    std::string out;
    std::string stage_from;                  // calibration file whose errors of the stage are used; empty: those of `calibration`
    std::vector<std::string> fixture_names;  // FILE=NAME
    bool refit_fixtures = false;
    bool csv_only = false;
    bool json = false;
};

Json json_of(const ErrorBand& band) {
    return {{"poses", band.poses},
            {"position_rms_m", band.position_m.rms},
            {"position_median_m", band.position_m.median},
            {"position_p95_m", band.position_m.p95},
            {"position_max_m", band.position_m.max},
            {"orientation_rms_deg", band.orientation_deg.rms},
            {"orientation_median_deg", band.orientation_deg.median},
            {"orientation_p95_deg", band.orientation_deg.p95},
            {"orientation_max_deg", band.orientation_deg.max}};
}

Json result_of(const EvaluateCommand& command, const ErrorReport& report, const std::string& stage_errors, bool fits_scale) {
    Json json = json_of(report.all);
    json["poses_not_converged"] = report.not_converged;
    json["iterations_max"] = report.iterations_max;
    json["misfit_share_max"] = report.misfit_share_max;
    json["solver"] = command.solver;
    json["fixtures"] = command.refit_fixtures ? "refitted on this data" : "from the calibration";
    json["scale"] = fits_scale ? "refitted on this data" : "from the calibration";
    json["stage_errors"] = stage_errors;
    json["bands"] = Json::array();
    for (const ErrorBand& band : report.bands) {
        auto entry = json_of(band);
        entry["from_m"] = band.from_m;
        entry["to_m"] = band.to_m;
        json["bands"].push_back(entry);
    }
    json["residual"] = {{"source_axes_rms_m", {report.axis_rms_m(0), report.axis_rms_m(1), report.axis_rms_m(2)}},
                        {"smooth_in_position_m", report.smooth_rms_m},
                        {"rough_m", report.rough_rms_m},
                        {"repeats_with_attitude_m", report.attitude_rms_m}};
    return json;
}

/// Poses whose misfit alone exceeds the limit of the flag `distorted` with the calibrated floor.
void count_distorted(const std::vector<EvaluatedPose>& errors, double misfit_floor, Json& result) {
    result["misfit_floor"] = misfit_floor;
    result["poses_distorted"] = std::count_if(errors.begin(), errors.end(), [&](const EvaluatedPose& error) {
        return misfit_floor_of(error.misfit_share) > misfit_floor;
    });
}

/// The same for the quadrature.
void count_quadratures(const calibration::Calibration<double>& known, const std::vector<PoseFile>& files, Json& result) {
    if (known.quadrature_floor >= 1 || !have_quadrature(files)) {
        return;
    }
    const std::vector<double> shares = quadrature_shares(known, files);
    result["quadrature_floor"] = known.quadrature_floor;
    result["poses_beyond_quadrature_floor"] = std::count_if(
        shares.begin(), shares.end(), [&](double share) { return exceeds_quadrature_floor(share, known.quadrature_floor); });
}

/// Errors of the positions in standard deviations that a tracker states without noise.
void compare_with_stated(const std::vector<EvaluatedPose>& errors, Json& result) {
    constexpr std::array<double, 3> kNormalWithin{0.1987, 0.7385, 0.9707};  // of a normal distribution in three dimensions
    double squared_m2 = 0;
    double squared_sigmas = 0;
    std::array<double, 3> within{};
    double poses = 0;
    for (const EvaluatedPose& e : errors) {
        if (e.converged && e.deviation_m > 0) {
            ++poses;
            squared_m2 += e.deviation_m * e.deviation_m;
            squared_sigmas += e.sigmas * e.sigmas;
            for (std::size_t n = 0; n < within.size(); ++n) {
                within[n] += e.sigmas <= static_cast<double>(n + 1) ? 1 : 0;
            }
        }
    }
    std::ranges::for_each(within, [&](double& share) { share /= poses; });
    if (poses > 0) {
        result["stated"] = {{"position_rms_m", std::sqrt(squared_m2 / poses)},
                            {"within_1_2_3_sigma", within},
                            {"expected_within", kNormalWithin},
                            {"nees_per_degree", squared_sigmas / (3 * poses)}};
    }
}

/// Mean change of the quadratures of the surroundings, whose calibration leaves `deviation` at each pose. Errors of neighbouring
/// poses are alike, so that of the mean is not assumed to be smaller.
void judge_surroundings(const std::vector<EvaluatedPose>& errors, double deviation, Json& result) {
    constexpr double kGate = 3;  // standard deviations
    double sum = 0;
    double poses = 0;
    for (const EvaluatedPose& error : errors) {
        sum += error.surroundings_change.value_or(0);
        poses += error.surroundings_change ? 1 : 0;
    }
    if (poses > 0) {
        const double change = sum / poses;
        result["surroundings"] = {
            {"change", change}, {"change_sigma", deviation}, {"moved", std::abs(change) > kGate * deviation}};
    }
}

std::string row(const std::string& name, const Json& band) {
    return fmt::format("  {:<14}", name) +
           fill(band,
                " {poses:>6} {position_rms_m in mm:>9.4f} {position_median_m in mm:>8.4f} {position_p95_m in mm:>8.4f} "
                "{position_max_m in mm:>8.4f}   {orientation_rms_deg:>8.4f} {orientation_median_deg:>8.4f} "
                "{orientation_p95_deg:>8.4f} {orientation_max_deg:>8.4f}\n");
}

std::string evaluation_text(const Json& r) {
    const char* const fixtures = r["fixtures"] == "from the calibration" ? "fixtures from the calibration"
                                 : r["scale"] == "from the calibration"  ? "fixtures REFITTED on this data"
                                                                         : "fixtures and scale REFITTED on this data";
    std::string text = fill(r, "{poses} poses, {solver} solver, ") + fixtures;
    text += fill(r, ", errors of the stage {stage_errors}; {poses_not_converged} did not converge\n");
    text += "  range           poses    RMS mm   median     95 %      max    RMS deg   median     95 %      max\n";
    for (const Json& band : r["bands"]) {
        text += row(fill(band, "{from_m:.2f}-{to_m:.2f} m"), band);
    }
    text += row("all", r);
    if (r.contains("misfit_floor")) {
        text += fill(
            r, "  {poses_distorted} poses have a misfit beyond the calibrated floor ({misfit_floor in %:.3f} % per coupling)\n");
    }
    if (r.contains("quadrature_floor")) {
        text += fill(r,
                     "  {poses_beyond_quadrature_floor} poses have a quadrature beyond the calibrated floor "
                     "({quadrature_floor in %:.3f} % per coupling)\n");
    }
    if (r.contains("surroundings")) {
        text += fill(r["surroundings"],
                     "  quadratures of the surroundings: {change in %:+.1f} % of the calibrated ones (standard deviation "
                     "{change_sigma in %:.1f} %)") +
                (r["surroundings"]["moved"] ? ": metal has moved, calibrate the surroundings again\n" : ": unchanged\n");
    }
    if (r.contains("stated")) {
        text += fill(
            r["stated"],
            "  stated deviation {position_rms_m in mm:.3f} mm (RMS, without noise); {within_1_2_3_sigma/0 in %:.1f}, "
            "{within_1_2_3_sigma/1 in %:.1f}, {within_1_2_3_sigma/2 in %:.1f} % of the errors within 1, 2, 3 of it "
            "(expected {expected_within/0 in %:.1f}, {expected_within/1 in %:.1f}, {expected_within/2 in %:.1f} %); NEES per "
            "degree of freedom {nees_per_degree:.2f} (1: as stated, more: too small)\n");
    }
    return text + fill(r["residual"],
                       "  error by cause: position in the workspace {smooth_in_position_m in mm:.3f} mm, attitude "
                       "{repeats_with_attitude_m in mm:.3f} mm, other {rough_m in mm:.3f} mm (RMS)\n");
}

/// Checks the options of both kinds of evaluation.
void check_options(const EvaluateCommand& command, bool is_dynamic) {
    refuse_if(is_dynamic && (command.data.size() != 2 || !command.calibration.empty() || command.refit_fixtures ||
                             !command.stage_from.empty() || !command.fixture_names.empty() || !command.wiring.empty()),
              "--dynamic takes two files, TRUTH and POSES, no calibration and no wiring");
    refuse_if(!is_dynamic && command.calibration.empty(),
              "--calibration is required: the TOML file of tricoil calibrate (or use --dynamic)");
}

/// A wrong minimum, or other coils, also give poses, far from the true ones. Metal, which no pose explains, is not refused.
void refuse_wrong_fixtures(double expected, const std::vector<EvaluatedPose>& errors) {
    constexpr double kFactor = 10;
    constexpr double kAlways = 0.02;
    const auto rms = [&](double EvaluatedPose::*share) {
        return std::sqrt(std::transform_reduce(errors.begin(), errors.end(), 0.0, std::plus<>(),
                                               [&](const EvaluatedPose& error) { return error.*share * (error.*share); }) /
                         static_cast<double>(errors.size()));
    };
    const double share = rms(&EvaluatedPose::unexplained_share);
    refuse_if(
        std::ranges::none_of(errors, &EvaluatedPose::converged) ||
            share > std::max(kFactor * std::max(expected, rms(&EvaluatedPose::misfit_share)), kAlways),
        "--refit-fixtures: found no fixtures that fit these data: they leave {:.1f} % of the couplings unexplained, {:.2g} % "
        "in the calibration; are the data of these coils and of one mounting for each fixture?",
        100 * share, 100 * expected);
}

/// Sets the errors of the stage that the evaluation removes. Returns their origin.
std::string choose_stage_errors(const EvaluateCommand& command, CalibrationFile& calibration) {
    if (command.stage_from.empty()) {
        return calibration.stage_errors.is_ideal() ? "none" : "from the calibration";
    }
    const CalibrationFile other = read_calibration(command.stage_from);
    refuse_if(other.stage_errors.is_ideal(),
              "{}: has no errors of the stage; make it with tricoil calibrate stage --stage turning or room", command.stage_from);
    refuse_if(!calibration.source_stage.empty() && other.stage_turns_left_handed != calibration.stage_turns_left_handed,
              "{}: its stage counts angles in the opposite sense; use a calibration of the same stage", command.stage_from);
    if (!other.stage_errors.stray.isZero(0)) {
        print_notice(
            "tricoil: {}: the stray field belongs to its own source and is not used; the errors of the stage that were fitted "
            "with it carry over only in part\n",
            command.stage_from);
    }
    calibration.stage_errors = {other.stage_errors.turning, other.stage_errors.room, Mat3<double>::Zero()};
    return "from " + command.stage_from;
}

void write_errors(const std::string& folder, const std::string& csv) {
    std::error_code error;
    std::filesystem::create_directory(folder, error);
    refuse_if(error || !std::filesystem::is_directory(folder),
              "cannot use output folder {}: {}; create its parent or choose another", folder,
              error ? error.message() : "it is a file");
    write_whole_file(std::filesystem::path(folder) / "pose_errors.csv", csv);
    std::filesystem::remove(std::filesystem::path(folder) / "error_vectors.svg", error);  // of older errors
}

int evaluate_command(const EvaluateCommand& command) {
    const std::string errors_file = command.out.empty() ? "" : command.out + "/pose_errors.csv";
    check_outputs({{"--out", errors_file}}, command.data);
    check_outputs({{"--out", errors_file}}, {command.calibration, command.wiring, command.stage_from});
    const auto solver = static_cast<EvaluationSolver>(index_of_name("solver", command.solver, kSolvers));
    CalibrationFile calibration = read_calibration(command.calibration);
    refuse_if(solver == EvaluationSolver::direct && !calibration.surroundings.empty(),
              "--solver direct: does not use the surroundings of the calibration; use refined");
    auto files = read_pose_files(command.data, command.fixture_names, read_wiring(command.wiring));
    (void)correct_board(files, calibration.calibration);
    refuse_if(calibration.source_stage.empty() && !command.refit_fixtures,
              "{}: has no fixtures (not calibrated on a stage); use --refit-fixtures", command.calibration);
    const std::string stage_errors = choose_stage_errors(command, calibration);
    const bool fits_scale = command.refit_fixtures && has_free_scale(calibration);
    const double expected = calibration.residual_rms;
    if (command.refit_fixtures) {
        calibration = with_refitted_fixtures(calibration, files, solver);
    } else {
        correct_wiring(calibration, files);
    }
    const auto errors = evaluate(calibration, files, solver);
    if (command.refit_fixtures) {
        refuse_wrong_fixtures(expected, errors);
    }
    const ErrorReport report = summarise_errors(errors, files);
    if (!command.out.empty()) {
        write_errors(command.out, error_csv(errors, files));
    }
    Json result = result_of(command, report, stage_errors, fits_scale);
    if (calibration.calibration.misfit_floor > 0) {
        count_distorted(errors, calibration.calibration.misfit_floor, result);
    }
    count_quadratures(calibration.calibration, files, result);
    judge_surroundings(errors, calibration.quadrature.deviation, result);
    compare_with_stated(errors, result);
    print_result(result, command.json, evaluation_text);
    if (report.not_converged > 0) {
        print_notice("tricoil: {} poses did not converge and are not in the table: {}\n", report.not_converged,
                     places_not_converged(errors, files));
    }
    const int code = to_int(report.not_converged > 0 ? ExitCode::check_failed : ExitCode::fine);
    if (command.out.empty() || command.csv_only) {
        return code;
    }
    end_standard_output();
    return continue_in_python("evaluate-picture", {"--out=" + command.out, fmt::format("--code={}", code), "--"});
}

}  // namespace

void add_evaluate_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<EvaluateCommand>();
    sub->add_option("--calibration", c->calibration, "TOML file of tricoil calibrate")->type_name(kFileType);
    sub->add_option("data", c->data, "Couplings at stage poses: ILEMT text or CSV; with --dynamic TRUTH POSES")
        ->required()
        ->type_name(kFileType);
    one_of(sub->add_option("--solver", c->solver, "Closed form (direct), or Gauss-Newton with all coil parameters (refined)"),
           kSolvers)
        ->capture_default_str();
    file_name(sub->add_option(
        "--stage-from", c->stage_from,
        "Remove the errors of the stage that another calibration of the same stage found (calibrate stage --stage), "
        "without its stray field"));
    wiring_file(sub, c->wiring);
    add_fixture_names(sub, c->fixture_names);
    sub->add_flag("--refit-fixtures", c->refit_fixtures,
                  "Fit the fixtures to these data, and the scale of a free-motion calibration (stated in the output)");
    auto* const dynamic =
        sub->add_flag("--dynamic")
            ->description("Compare recorded poses of any tracker with a reference: motion errors, measured and predicted");
    sub->add_flag("--same-clock")
        ->description("--dynamic: --time-offset (default 0) is exact: the latency is measured")
        ->needs(dynamic);
    for (const auto& options : {add_python_options(sub, "dynamic"), add_reader_options(sub, "--dynamic: TRUTH,POSES")}) {
        std::ranges::for_each(options, [&](const std::string& option) { sub->get_option(option)->needs(dynamic); });
    }
    sub->add_option("--out", c->out, "Folder for the errors as CSV and picture")->type_name(kFolderType);
    sub->add_flag("--csv-only", c->csv_only, "CSV file only");
    sub->add_flag("--json", c->json, "Result as JSON");
    set_examples(
        sub, {{"poses that were not used for the calibration", "tricoil evaluate --calibration cal.toml --out errors test/*.dat"},
              {"a recorded pose stream against a reference", "tricoil evaluate --dynamic truth.csv poses.csv"}});
    sub->callback([c, sub, &action] {
        action = [c, sub] {
            check_options(*c, sub->count("--dynamic") > 0);
            return sub->count("--dynamic") > 0 ? continue_in_python(*sub) : evaluate_command(*c);
        };
    });
}

}  // namespace tricoil::host
