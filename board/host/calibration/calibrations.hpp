// Calibrations from couplings, as `tricoil calibrate stage`, `converters`, `grid` and `free-motion` make them: files, fits and
// report. Each function fills the report, and throws InputError as its fit does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "board/host/calibration/calibration_files.hpp"
#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/frame_file.hpp"

namespace tricoil::host {

/// fixture_names: FILE=NAME. converters: also the errors of the board's converters.
CalibrationFile calibrate_on_stage(const CalibrationFiles& of, FitOptions options, const std::vector<std::string>& fixture_names,
                                   bool converters, CalibrationReport& report);

/// nodes: if the data are rests. hemisphere: half space of most positions, source frame.
CalibrationFile calibrate_on_nodes(const CalibrationFiles& of, FitModel model, double spacing_m,
                                   const std::optional<GridSize>& nodes, const Vec3<double>& hemisphere,
                                   CalibrationReport& report);

struct FreeMotionOptions {
    std::optional<FitModel> model;            // not given: general, if the concentric model does not explain the couplings
    double column_skew = 0;                   // see deskewed()
    std::optional<double> coupling_constant;  // gives the scale of all lengths
    std::optional<Vec3<double>> hemisphere;   // default: +x
    ShowShare progress = {};                  // may be empty
};
CalibrationFile calibrate_by_motion(const CalibrationFiles& of, const FreeMotionOptions& options, CalibrationReport& report);

inline Json parameters_json(const CalibrationFit& fit) {
    Json list = Json::array();
    for (const FittedParameter& p : fit.parameters) {
        list.push_back({{"name", p.name}, {"value", p.value}, {"deviation", p.deviation}});
    }
    return list;
}

}  // namespace tricoil::host
