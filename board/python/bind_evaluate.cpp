// Poses of a calibrated tracker at the poses of a stage, for `tricoil evaluate`.
#include <pybind11/stl.h>

#include <algorithm>
#include <limits>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/wiring_file.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using host::CalibrationFile;

/// A pose; _evaluate.py names the columns. floor: of a tracker, at which this misfit is significant.
struct EvaluatedNumbers {
    double file, line, converged, iterations;
    Vec3<double> truth_m, error_m, rotation_error_rad;
    double range_m, position_error_m, orientation_error_deg, misfit_share, floor, deviation_m, sigmas, surroundings_change,
        unexplained_share;
    Matrix<double, 3, 3, Order::by_rows> stage_rotation;
};
constexpr py::ssize_t kNumbers = sizeof(EvaluatedNumbers) / sizeof(double);

/// Sets the errors of the stage that the evaluation removes: those of the file `from`, if it has a name.
void choose_stage_errors(const std::string& from, CalibrationFile& calibration) {
    if (from.empty()) {
        return;
    }
    const CalibrationFile other = host::read_calibration(from);
    host::refuse_if(other.stage_errors.is_ideal(),
                    "{}: has no errors of the stage; make it with tricoil calibrate stage --stage turning or room", from);
    host::refuse_if(!calibration.source_stage.empty() && other.stage_turns_left_handed != calibration.stage_turns_left_handed,
                    "{}: its stage counts angles in the opposite sense; use a calibration of the same stage", from);
    if (!other.stage_errors.stray.isZero(0)) {
        host::print_notice(
            "tricoil: {}: the stray field belongs to its own source and is not used; the errors of the stage that were fitted "
            "with it carry over only in part\n",
            from);
    }
    calibration.stage_errors = {other.stage_errors.turning, other.stage_errors.room, Mat3<double>::Zero()};
}

Array rows_of(const std::vector<host::EvaluatedPose>& errors, const std::vector<host::PoseFile>& files) {
    Array rows({static_cast<py::ssize_t>(errors.size()), kNumbers});
    auto* out = reinterpret_cast<EvaluatedNumbers*>(rows.mutable_data());
    auto e = errors.begin();
    for (const host::PoseFile& file : files) {
        for (const host::MeasuredPose& pose : file.poses) {
            *out++ = {static_cast<double>(e->file),
                      static_cast<double>(e->line),
                      e->converged ? 1.0 : 0.0,
                      static_cast<double>(e->iterations),
                      e->truth_m,
                      e->error_m,
                      e->rotation_error_rad,
                      e->truth_m.norm(),
                      e->error_m.norm(),
                      kDegrees * e->rotation_error_rad.norm(),
                      e->misfit_share,
                      host::misfit_floor_of(e->misfit_share),
                      e->deviation_m,
                      e->sigmas,
                      e->surroundings_change.value_or(std::numeric_limits<double>::quiet_NaN()),
                      e->unexplained_share,
                      pose.stage_rotation};
            ++e;
        }
    }
    return rows;
}

/// Poses (N, 31), and what is known of the calibration. beyond_quadrature_floor: -1: not known.
py::tuple evaluate(const std::vector<std::string>& data, const std::string& calibration_file, const std::string& wiring,
                   const std::string& stage_from, const std::vector<std::string>& fixture_names, const std::string& solver_name,
                   bool refit_fixtures) {
    using namespace py::literals;
    const auto solver = static_cast<host::EvaluationSolver>(host::index_of_name("solver", solver_name, {"direct", "refined"}));
    CalibrationFile calibration = host::read_calibration(calibration_file);
    host::refuse_if(solver == host::EvaluationSolver::direct && !calibration.surroundings.empty(),
                    "--solver direct: does not use the surroundings of the calibration; use refined");
    auto files = host::read_pose_files(data, fixture_names, host::read_wiring(wiring));
    (void)correct_board(files, calibration.calibration);
    host::refuse_if(calibration.source_stage.empty() && !refit_fixtures,
                    "{}: has no fixtures (not calibrated on a stage); use --refit-fixtures", calibration_file);
    choose_stage_errors(stage_from, calibration);
    const bool fits_scale = refit_fixtures && has_free_scale(calibration);
    const double residual_rms = calibration.residual_rms;
    LongCall call;
    const auto errors = [&] {
        const py::gil_scoped_release released;
        const auto check = [&] { call.check(); };
        if (refit_fixtures) {
            calibration = with_refitted_fixtures(calibration, files, solver, check);
        } else {
            correct_wiring(calibration, files);
        }
        return host::evaluate(calibration, files, solver, check);
    }();
    const auto& known = calibration.calibration;
    std::ptrdiff_t beyond = -1;
    if (known.quadrature_floor < 1 && have_quadrature(files)) {
        beyond = std::ranges::count_if(quadrature_shares(known, files), [&](double share) {
            return host::exceeds_quadrature_floor(share, known.quadrature_floor);
        });
    }
    return py::make_tuple(rows_of(errors, files),
                          py::dict("has_stage_errors"_a = !calibration.stage_errors.is_ideal(), "fits_scale"_a = fits_scale,
                                   "residual_rms"_a = residual_rms, "misfit_floor"_a = known.misfit_floor,
                                   "quadrature_floor"_a = known.quadrature_floor, "beyond_quadrature_floor"_a = beyond,
                                   "surroundings_deviation"_a = calibration.quadrature.deviation));
}

}  // namespace

void add_evaluate(py::module_& module) { module.def("evaluate", evaluate); }

}  // namespace tricoil::python
