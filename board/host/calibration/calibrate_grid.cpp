// Coils from a sensor on the nodes of a printed grid, for `tricoil calibrate grid`.
#include "board/host/calibration/calibrations.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

CalibrationFile calibrate_on_nodes(const CalibrationFiles& of, FitModel model, double spacing_m,
                                   const std::optional<GridSize>& nodes, const Vec3<double>& hemisphere,
                                   CalibrationReport& report) {
    Json& result = report.json;
    const calibration::Calibration<double> stored = stored_board(of);
    auto frames = read_grids(of.data, nodes, read_wiring(of.wiring));
    const LevelCount levels = correct_board(frames, stored);
    const Mat3<double> phase_rad = remove_own_phases(frames);
    const GridCalibration found = calibrate_on_grid(frames, spacing_m, hemisphere, model);
    result = {{"frames", frames.size()},
              {"unknown_levels", levels.unknown},
              {"position_rms_m", found.position_rms_m},
              {"misfit_before", found.misfit_before},
              {"misfit_after", found.misfit_after},
              {"coupling_constant", found.coils.model.source_moment.trace() / 3},
              {"coupling_constant_deviation", found.scale_deviation},
              {"pivots_m", Json::array()},
              {"source_moment", rows_of(found.coils.model.source_moment)},
              {"sensor", rows_of(found.coils.model.sensor_sensitivity)},
              {"parameters", parameters_json(found.coils)}};
    for (const Vec3<double>& pivot : found.pivot_m) {
        result["pivots_m"].push_back(list_of(pivot));
    }
    if (model != FitModel::concentric) {
        result["position_error_share"] = found.position_error_share;
        result["outliers"] = found.outliers;
    }
    report.warnings.insert(report.warnings.end(), found.coils.warnings.begin(), found.coils.warnings.end());
    CalibrationFile file;
    file.calibration = stored;
    file.model = "grid";
    file.residual_rms = found.misfit_after;
    file.calibration.model = found.coils.model;
    file.calibration.errors = found.coils.errors;
    file.calibration.misfit_floor = found.misfit_floor;
    file.calibration.phase_rad = phase_rad;
    file.calibration.quadrature_floor = quadrature_floor_of(quadrature_shares(file.calibration, frames));
    file.calibration.hemisphere = hemisphere.stableNormalized();
    return file;
}

}  // namespace tricoil::host
