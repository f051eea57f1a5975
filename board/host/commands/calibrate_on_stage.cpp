#include <fmt/format.h>

#include "board/host/calibration/converter_correction.hpp"
#include "board/host/calibration/converter_fit.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/error_map.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/fitted_parameters.hpp"
#include "board/support/json_rows.hpp"
#include "board/support/progress.hpp"

namespace tricoil::host {
namespace {

Vec3<double> mean_direction(const std::vector<PoseFile>& files, const CalibrationFit& fit) {
    Vec3<double> sum = Vec3<double>::Zero();
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            sum += true_pose(fit.source_stage.at(source_fixture_name(file)), pose, fit.mount_sensor.at(sensor_fixture_name(file)))
                       .position_m.normalized();
        }
    }
    return sum.normalized();
}

void describe_fit(const CalibrationFit& fit, const StageCommand& command, Json& result, std::vector<std::string>& warnings) {
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
        warnings.push_back(place + ": outlier, not used");
    }
    warnings.insert(warnings.end(), fit.warnings.begin(), fit.warnings.end());
    if (fit.stage_turns_left_handed) {
        warnings.emplace_back("the stage counts angles in the left-handed sense; its rotations are inverted");
    }
}

}  // namespace

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
    return text + (r.contains("affine_position_rms_m")
                       ? fill(r, "  affine output correction: {affine_position_rms_m in mm:.4f} mm RMS on the same poses\n")
                       : "");
}

CalibrationFile calibrate_on_stage(const StageCommand& command, Json& result, std::vector<std::string>& warnings) {
    FitOptions options;
    options.model = command.model;
    options.fixtures = command.fixtures;
    options.stage = command.stage;
    auto files = read_pose_files(command.data);
    result["unknown_levels"] = correct_converters(files, command.stored_converters).unknown;
    const Mat3<double> phase_rad = remove_own_phases(files);
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
    describe_fit(fit, command, result, warnings);
    CalibrationFile file;
    file.calibration.converters = converters.errors;
    file.calibration.model = fit.model;
    file.model = to_string(options.model);
    file.source_stage = fit.source_stage;
    file.mount_sensor = fit.mount_sensor;
    file.stage_turns_left_handed = fit.stage_turns_left_handed;
    file.stage_errors = fit.stage_errors;
    file.residual_rms = fit.residual_rms;
    file.calibration.hemisphere = mean_direction(files, fit);
    file.calibration.phase_rad = phase_rad;
    file.calibration.quadrature_floor = quadrature_floor_of(quadrature_shares(file.calibration, files));
    const auto solver = options.model == FitModel::concentric ? EvaluationSolver::direct : EvaluationSolver::refined;
    const auto errors = evaluate(file, files, solver);
    const ErrorBand all = error_band(errors);
    file.calibration.misfit_floor = misfit_floor_of(errors, fit.outliers.size());
    result["misfit_floor"] = file.calibration.misfit_floor;
    result["position_rms_m"] = all.position_m.rms;
    result["position_p95_m"] = all.position_m.p95;
    result["orientation_rms_deg"] = all.orientation_deg.rms;
    result["orientation_p95_deg"] = all.orientation_deg.p95;
    if (command.affine) {
        fit_output_correction(file, errors);
        result["affine_position_rms_m"] = error_band(evaluate(file, files, solver)).position_m.rms;
    }
    return file;
}

}  // namespace tricoil::host
