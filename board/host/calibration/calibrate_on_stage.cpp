// Fit of coils, fixtures and converters to couplings at known poses, for `tricoil calibrate stage` and `converters`.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "board/host/calibration/calibrations.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/statistics.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

Vec3<double> mean_direction(const std::vector<PoseFile>& files, const CalibrationFile& calibration) {
    Vec3<double> sum = Vec3<double>::Zero();
    for_each_pose(calibration, files, [&](std::size_t, const MeasuredPose&, const solver::RigidPose<double>& truth) {
        sum += truth.position_m.normalized();
    });
    return sum.normalized();
}

void describe_fit(const CalibrationFit& fit, const FitOptions& options, CalibrationReport& report) {
    Json& result = report.json;
    result["poses"] = fit.poses;
    result["model"] = to_string(options.model);
    result["fixtures"] = to_string(options.fixtures);
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

}  // namespace

CalibrationFile calibrate_on_stage(const CalibrationFiles& of, FitOptions options, const std::vector<std::string>& fixture_names,
                                   bool converters, CalibrationReport& report) {
    Json& result = report.json;
    const calibration::Calibration<double> stored = stored_board(of);
    options.finds_pick_up = stored.pick_up.is_none();
    auto files = read_pose_files(of.data, fixture_names, read_wiring(of.wiring));
    result["unknown_levels"] = correct_board(files, stored).unknown;
    auto measured = files;
    (void)remove_own_phases(files);
    ConverterFit found;
    if (converters) {
        found = fit_converters(files, options);
        result["converters"] = {{"non_linearity_lsb", found.non_linearity_lsb}, {"gain_error", found.gain_error}};
    } else {
        found.coils = fit_calibration(files, options);
    }
    const CalibrationFit& fit = found.coils;
    describe_fit(fit, options, report);
    files = std::move(measured);
    correct_converters(files, found.errors);
    correct_files(fit, files);
    const Mat3<double> phase_rad = remove_own_phases(files);  // of the channels: not before the order of the couplings is known
    for (const auto& [path, wiring] : fit.wiring) {
        if (wiring.differs()) {
            refuse_if(!stored.pick_up.is_none() ||
                          (wiring.transposed && (converters || stored.converters != signal::ConverterErrors{})),
                      "{}: {}; errors of converters and pick-up need the wiring with which they were measured: correct the file",
                      path, wiring.text());
            report.warnings.push_back(fmt::format("{}: {}; corrected", path, wiring.text()));
        }
    }
    CalibrationFile file;
    file.calibration = stored;
    file.calibration.converters = converters ? found.errors : stored.converters;
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

}  // namespace tricoil::host
