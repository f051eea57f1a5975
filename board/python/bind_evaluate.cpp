// Pose errors of a calibrated tracker at known poses.
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using host::EvaluatedPose;

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
    host::refuse_if(
        std::ranges::none_of(errors, &EvaluatedPose::converged) ||
            share > std::max(kFactor * std::max(expected, rms(&EvaluatedPose::misfit_share)), kAlways),
        "--refit-fixtures: found no fixtures that fit these data: they leave {:.1f} % of the couplings unexplained, {:.2g} % "
        "in the calibration; are the data of these coils and of one mounting for each fixture?",
        100 * share, 100 * expected);
}

/// Sets the errors of the stage that the evaluation removes. Returns their origin.
std::string choose_stage_errors(const std::string& stage_from, host::CalibrationFile& calibration) {
    if (stage_from.empty()) {
        return calibration.stage_errors.is_ideal() ? "none" : "from the calibration";
    }
    const host::CalibrationFile other = host::read_calibration(stage_from);
    host::refuse_if(other.stage_errors.is_ideal(),
                    "{}: has no errors of the stage; make it with tricoil calibrate stage --stage turning or room", stage_from);
    host::refuse_if(!calibration.source_stage.empty() && other.stage_turns_left_handed != calibration.stage_turns_left_handed,
                    "{}: its stage counts angles in the opposite sense; use a calibration of the same stage", stage_from);
    if (!other.stage_errors.stray.isZero(0)) {
        host::print_notice(
            "tricoil: {}: the stray field belongs to its own source and is not used; the errors of the stage that were fitted "
            "with it carry over only in part\n",
            stage_from);
    }
    calibration.stage_errors = {other.stage_errors.turning, other.stage_errors.room, Mat3<double>::Zero()};
    return "from " + stage_from;
}

EvaluatedRow to_row(const EvaluatedPose& error, const host::MeasuredPose& pose) {
    EvaluatedRow row;
    row.file = static_cast<std::uint32_t>(error.file);
    row.line = static_cast<std::uint32_t>(error.line);
    row.converged = error.converged;
    row.iterations = error.iterations;
    put(error.truth_m, row.truth_m);
    put(error.error_m, row.error_m);
    put(error.rotation_error_rad, row.rotation_error_rad);
    copy_rows(pose.stage_rotation, row.stage_rotation);
    row.misfit_share = error.misfit_share;
    row.misfit_floor = host::misfit_floor_of(error.misfit_share);
    row.sigmas = error.sigmas;
    row.deviation_m = error.deviation_m;
    row.surroundings_change = error.surroundings_change.value_or(std::numeric_limits<double>::quiet_NaN());
    return row;
}

/// Errors of all poses, and what is known of the calibration. Empty names: no such file.
py::tuple evaluated_poses(const std::vector<std::string>& data, const std::string& calibration_file, const std::string& wiring,
                          const std::string& stage_from, const std::vector<std::string>& fixture_names,
                          const std::string& solver_name, bool refits_fixtures) {
    const auto solver = static_cast<host::EvaluationSolver>(host::index_of_name("solver", solver_name, {"direct", "refined"}));
    host::CalibrationFile calibration = host::read_calibration(calibration_file);
    host::refuse_if(solver == host::EvaluationSolver::direct && !calibration.surroundings.empty(),
                    "--solver direct: does not use the surroundings of the calibration; use refined");
    auto files = host::read_pose_files(data, fixture_names, host::read_wiring(wiring));
    (void)host::correct_board(files, calibration.calibration);
    host::refuse_if(calibration.source_stage.empty() && !refits_fixtures,
                    "{}: has no fixtures (not calibrated on a stage); use --refit-fixtures", calibration_file);
    py::dict facts;
    facts["stage_errors"] = choose_stage_errors(stage_from, calibration);
    facts["fits_scale"] = refits_fixtures && has_free_scale(calibration);
    const double expected = calibration.residual_rms;
    if (refits_fixtures) {
        calibration = with_refitted_fixtures(calibration, files, solver);
    } else {
        correct_wiring(calibration, files);
    }
    const auto errors = evaluate(calibration, files, solver);
    if (refits_fixtures) {
        refuse_wrong_fixtures(expected, errors);
    }
    std::vector<EvaluatedRow> rows;
    host::for_each_row(files, [&](const host::MeasuredPose& pose) { rows.push_back(to_row(errors[rows.size()], pose)); });
    std::vector<std::string> paths;
    std::ranges::transform(files, std::back_inserter(paths), &host::PoseFile::path);
    const auto& known = calibration.calibration;
    facts["paths"] = paths;
    facts["not_converged"] = host::places_not_converged(errors, files);
    facts["misfit_floor"] = known.misfit_floor;
    facts["quadrature_floor"] = known.quadrature_floor;
    facts["quadrature_deviation"] = calibration.quadrature.deviation;
    if (known.quadrature_floor < 1 && host::have_quadrature(files)) {
        facts["poses_beyond_quadrature_floor"] = std::ranges::count_if(host::quadrature_shares(known, files), [&](double share) {
            return host::exceeds_quadrature_floor(share, known.quadrature_floor);
        });
    }
    return py::make_tuple(to_array(std::move(rows)), facts);
}

}  // namespace

void add_evaluation(py::module_& module) { module.def("evaluated_poses", evaluated_poses); }

}  // namespace tricoil::python
