#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/progress.hpp"
#include "board/support/statistics.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

struct StageCommand {
    CalibrationFiles files;
    FitModel model = FitModel::general;
    FixtureModel fixtures = FixtureModel::free;
    StageModel stage = StageModel::ideal;
    const CLI::Option* stage_option = nullptr;  // not given: by the number of mountings
    std::vector<std::string> fixture_names;     // FILE=NAME
    bool converters = false;                    // also the errors of the board's converters
};

Vec3<double> mean_direction(const std::vector<PoseFile>& files, const CalibrationFile& calibration) {
    Vec3<double> sum = Vec3<double>::Zero();
    for_each_pose(calibration, files, [&](std::size_t, const MeasuredPose&, const solver::RigidPose<double>& truth) {
        sum += truth.position_m.normalized();
    });
    return sum.normalized();
}

void describe_fit(const CalibrationFit& fit, const StageCommand& command, CalibrationReport& report) {
    Json& result = report.json;
    result["poses"] = fit.poses;
    result["model"] = to_string(command.model);
    result["fixtures"] = to_string(command.fixtures);
    result["start_position_rms_m"] = fit.start_position_rms_m;
    result["residual_rms"] = fit.residual_rms;
    result["condition"] = fit.condition;
    result["coupling_constant"] = fit.coupling_constant;
    result["parameters"] = parameters_json(fit);
    if (!fit.stage_errors.is_ideal()) {
        result["stage_errors"] = {{"turning", rows_of(fit.stage_errors.turning)},
                                  {"room", rows_of(fit.stage_errors.room)},
                                  {"stray", rows_of(fit.stage_errors.stray)}};
    }
    result["residual_rms_by_file"] = fit.residual_rms_by_file;
    result["outliers"] = fit.outliers;
    for (const std::string& place : fit.outliers) {
        report.warnings.push_back(place + ": outlier, not used");
    }
    report.warnings.insert(report.warnings.end(), fit.warnings.begin(), fit.warnings.end());
    if (fit.stage_turns_left_handed) {
        report.warnings.emplace_back("the stage counts angles in the left-handed sense; its rotations are inverted");
    }
}

std::string stage_text(const Json& r) {
    std::string text =
        fill(r,
             "{poses} poses, model {model}, fixtures {fixtures}; closed-form start {start_position_rms_m in mm:.2f} mm, "
             "couplings unexplained {residual_rms in %:.3f} %, condition number {condition:.0f}\n"
             "  moments in units of C = {coupling_constant:.6g}\n");
    text += parameters_text(r["parameters"]);
    for (const auto& [path, rms] : r["residual_rms_by_file"].items()) {
        text += fmt::format("  {}: couplings unexplained {:.3f} %\n", path, 100 * rms.get<double>());
    }
    text += fill(r,
                 "  on these poses: {position_rms_m in mm:.4f} mm, {orientation_rms_deg:.4f} deg RMS "
                 "(95 % {position_p95_m in mm:.4f} mm, {orientation_p95_deg:.4f} deg)\n");
    if (r.contains("converters")) {
        text += fill(r["converters"],
                     "  converters: non-linearity {non_linearity_lsb:.2f} LSB, gain steps {gain_error in %:.3f} % RMS\n");
    }
    return text;
}

/// As it is measured, before the phases are removed: its part across the couplings is not known and taken as zero.
calibration::PickUp<double> measured_pick_up(const CalibrationFit& fit, const Mat3<double>& phase_rad) {
    const auto along = [&](double (*part)(double)) { return fit.pick_up.cwiseProduct(phase_rad.unaryExpr(part)); };
    return {along(std::cos), along(std::sin), fit.pick_up_sigma};
}

/// Errors of the poses that converged, and a warning with the places of the others.
void report_errors(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files, CalibrationReport& report) {
    constexpr std::size_t kNamed = 5;
    std::vector<double> position_m;
    std::vector<double> orientation_deg;
    std::vector<std::string> places;
    for (const EvaluatedPose& e : errors) {
        if (e.converged) {
            position_m.push_back(e.error_m.norm());
            orientation_deg.push_back(kDegrees * e.rotation_error_rad.norm());
        } else {
            places.push_back(fmt::format("{}:{}", files[e.file].path, e.line));
        }
    }
    if (!places.empty()) {
        const std::string more = places.size() > kNamed ? fmt::format(" and {} more", places.size() - kNamed) : "";
        places.resize(std::min(places.size(), kNamed));
        report.warnings.push_back(fmt::format("{}{}: did not converge, not in the RMS", fmt::join(places, ", "), more));
    }
    const ErrorSummary position = summarise(position_m);
    const ErrorSummary orientation = summarise(orientation_deg);
    report.json["position_rms_m"] = position.rms;
    report.json["position_p95_m"] = position.p95;
    report.json["orientation_rms_deg"] = orientation.rms;
    report.json["orientation_p95_deg"] = orientation.p95;
}

CalibrationFile calibrate_on_stage(const StageCommand& command, CalibrationReport& report) {
    Json& result = report.json;
    const calibration::Calibration<double> stored = stored_board(command.files);
    FitOptions options;
    options.model = command.model;
    options.fixtures = command.fixtures;
    options.finds_pick_up = stored.pick_up.is_none();
    if (command.stage_option->count() > 0) {
        options.stage = command.stage;
    }
    auto files = read_pose_files(command.files.data, command.fixture_names, read_wiring(command.files.wiring));
    result["unknown_levels"] = correct_board(files, stored).unknown;
    auto measured = files;
    (void)remove_own_phases(files);
    Progress progress("calibrate");
    options.progress = progress.part(0, 1);
    ConverterFit converters;
    if (command.converters) {
        converters = fit_converters(files, options);
        result["converters"] = {{"non_linearity_lsb", converters.non_linearity_lsb}, {"gain_error", converters.gain_error}};
    } else {
        converters.coils = fit_calibration(files, options);
    }
    const CalibrationFit& fit = converters.coils;
    describe_fit(fit, command, report);
    files = std::move(measured);
    correct_converters(files, converters.errors);
    correct_files(fit, files);
    const Mat3<double> phase_rad = remove_own_phases(files);  // of the channels: not before the order of the couplings is known
    for (const auto& [path, wiring] : fit.wiring) {
        if (wiring.differs()) {
            refuse_if(!stored.pick_up.is_none() ||
                          (wiring.transposed && (command.converters || stored.converters != signal::ConverterErrors{})),
                      "{}: {}; errors of converters and pick-up need the wiring with which they were measured: correct the file",
                      path, wiring.text());
            report.warnings.push_back(fmt::format("{}: {}; corrected", path, wiring.text()));
        }
    }
    CalibrationFile file;
    file.calibration = stored;
    file.calibration.converters = command.converters ? converters.errors : stored.converters;
    file.calibration.pick_up = stored.pick_up.is_none() ? measured_pick_up(fit, phase_rad) : stored.pick_up;
    for_each_row(files, [&](MeasuredPose& pose) { pose.x -= fit.pick_up; });
    file.calibration.model = fit.model;
    file.calibration.errors = fit.errors;
    file.model = to_string(options.model);
    file.source_stage = fit.source_stage;
    file.mount_sensor = fit.mount_sensor;
    file.stage_turns_left_handed = fit.stage_turns_left_handed;
    file.stage_errors = fit.stage_errors;
    file.residual_rms = fit.residual_rms;
    file.calibration.hemisphere = mean_direction(files, file);
    file.calibration.phase_rad = phase_rad;
    file.calibration.quadrature_floor = quadrature_floor_of(quadrature_shares(file.calibration, files));
    const auto solver = options.model == FitModel::concentric ? EvaluationSolver::direct : EvaluationSolver::refined;
    auto errors = evaluate(file, files, solver);
    file.calibration.misfit_floor = misfit_floor_of(errors, fit.outliers.size());
    state_deviations(file.calibration, errors);
    file.calibration.errors.floor_share = floor_share_of(errors, fit.outliers.size());
    result["misfit_floor"] = file.calibration.misfit_floor;
    report_errors(errors, files, report);
    return file;
}

void add_kind_on_stage(CLI::App* kind, const std::shared_ptr<StageCommand>& c, Action& action) {
    add_model(kind, c->model);
    add_named(kind, "--fixtures", c->fixtures, {to_string(FixtureModel::free), to_string(FixtureModel::named)},
              "Estimate the rotation of each sensor fixture (free), or take it from the fixture's name (named)");
    add_named(kind, "--stage", c->stage, {"ideal", "turning", "room"},
              "Errors of the stage to estimate: none (ideal), linear in the position in the turning frame (turning), also linear "
              "in the position in the room, and a uniform stray field (room; the default for several mountings of the source)");
    c->stage_option = kind->get_option("--stage");
    wiring_file(kind, c->files.wiring);
    add_fixture_names(kind, c->fixture_names);
    add_out_and_blob(kind, c->files);
    set_fit(kind, action, c, calibrate_on_stage, stage_text);
}

}  // namespace

void add_stage_calibrations(CLI::App* calibrate, Action& action) {
    auto stage = std::make_shared<StageCommand>();
    CLI::App* kind = add_kind(calibrate, "stage", "Coils and fixtures, from couplings at known poses of a stage", stage->files,
                              "Couplings at stage poses (ILEMT text or CSV)");
    add_kind_on_stage(kind, stage, action);
    add_converters_from(kind, stage->files);
    set_examples(kind, {{"coils and fixtures from couplings at known poses",
                         "tricoil calibrate stage --model finite --out cal.toml --blob cal.bin stage/*.dat"}});
    auto board = std::make_shared<StageCommand>();
    board->converters = true;
    kind = add_kind(calibrate, "converters",
                    "The same, with the non-linearity of the board's converters and the errors of its gain steps (TDM)",
                    board->files, "Couplings at stage poses with a11 to a33 and gain_step, as convert --to rests gives them");
    add_kind_on_stage(kind, board, action);
    set_examples(kind, {{"coils and converters of a tracker board, from its rests on a stage",
                         "tricoil calibrate converters --model concentric --out cal.toml --blob cal.bin rests.csv"}});
}

}  // namespace tricoil::host
