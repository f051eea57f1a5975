// Calibrations from couplings, for `tricoil calibrate`; each returns its result as JSON.
#include <pybind11/stl.h>

#include "board/host/calibration/calibrations.hpp"
#include "board/host/commands/command_list.hpp"
#include "board/python/parts.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// Calls `fit` without the GIL, with the report and a function for the finished share, and writes the files.
template <typename Fit>
std::string calibrate(const host::CalibrationFiles& files, Fit fit) {
    const py::gil_scoped_release released;
    check_files(files);
    host::Progress progress("calibrate");
    host::CalibrationReport report;
    const auto show = [&](double share) {
        check_signals();
        progress.show(share);
    };
    const host::CalibrationFile file = fit(report, show);
    check_signals();  // before anything is written
    write_calibration(files, file, report);
    return host::json_line(report.json);
}

host::FitModel model_of(const std::string& name) {
    return static_cast<host::FitModel>(host::index_of_name("model", name, {"concentric", "general", "finite"}));
}

std::string calibrate_stage(const host::CalibrationFiles& files, const std::string& model, const std::string& fixtures,
                            const std::optional<std::string>& stage, const std::vector<std::string>& fixture_names,
                            bool converters) {
    host::FitOptions options;
    options.model = model_of(model);
    options.fixtures = static_cast<host::FixtureModel>(host::index_of_name("fixtures", fixtures, {"free", "named"}));
    if (stage) {
        options.stage = static_cast<host::StageModel>(host::index_of_name("stage", *stage, {"ideal", "turning", "room"}));
    }
    return calibrate(files, [&](host::CalibrationReport& report, const host::ShowShare& progress) {
        options.progress = progress;
        return calibrate_on_stage(files, options, fixture_names, converters, report);
    });
}

std::string calibrate_grid(const host::CalibrationFiles& files, const std::string& model, double spacing_mm,
                           const std::optional<host::GridSize>& nodes, const std::array<double, 3>& hemisphere) {
    return calibrate(files, [&](host::CalibrationReport& report, const host::ShowShare& /*progress*/) {
        return calibrate_on_nodes(files, model_of(model), 1e-3 * spacing_mm, nodes, Vec3<double>(hemisphere.data()), report);
    });
}

std::string calibrate_free_motion(const host::CalibrationFiles& files, const std::optional<std::string>& model,
                                  double column_skew, const std::optional<double>& coupling_constant,
                                  const std::optional<std::array<double, 3>>& hemisphere) {
    host::FreeMotionOptions options;
    options.column_skew = column_skew;
    options.coupling_constant = coupling_constant;
    if (model) {
        options.model = model_of(*model);
    }
    if (hemisphere) {
        options.hemisphere = Vec3<double>(hemisphere->data());
    }
    return calibrate(files, [&](host::CalibrationReport& report, const host::ShowShare& progress) {
        options.progress = progress;
        return calibrate_by_motion(files, options, report);
    });
}

}  // namespace

void add_calibrate(py::module_& module) {
    py::class_<host::CalibrationFiles>(module, "CalibrationFiles")
        .def(py::init<std::vector<std::string>, std::string, std::string, std::string, std::string, std::string>());
    module.def("renew_calibrate", host::renew_calibrate);
    module.def("calibrate_stage", calibrate_stage);
    module.def("calibrate_grid", calibrate_grid);
    module.def("calibrate_free_motion", calibrate_free_motion);
}

}  // namespace tricoil::python
