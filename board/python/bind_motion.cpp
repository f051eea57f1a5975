// The error model: the paper's examples, and systematic errors of poses.
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "core/error_model/accumulated_error.hpp"
#include "core/error_model/cartesian_error.hpp"
#include "core/error_model/error_budget.hpp"
#include "sim/paper/paper_simulation.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// Columns of the updates, which _motion.py names; all of the predicted errors are NaN if there is no prediction.
Array motion(const std::string& example, const std::string& loop, const std::string& form, const std::string& kappa, int passes,
             double rate_hz, double duration_s, const py::object& progress) {
    LongCall call(progress);
    std::vector<double> columns;
    {
        const py::gil_scoped_release released;
        const auto& names = paper::example_names();
        const paper::Example chosen = paper::example(names[host::index_of_name("example", example, names)]);
        host::refuse_if(!(rate_hz >= 1 && rate_hz <= 1e5), "rate_hz must be 1 to 1e5");
        paper::SimulationParams params;
        params.loop = static_cast<error_model::Loop>(host::index_of_name("loop", loop, {"open", "closed"}));
        params.form = static_cast<paper::Form>(host::index_of_name("form", form, {"angles", "vectors"}));
        params.kappa = static_cast<error_model::KappaForm>(host::index_of_name("kappa", kappa, {"exact", "paper", "two"}));
        params.passes = passes;
        params.update_s = 1 / rate_hz;
        params.duration_s = duration_s;
        const double none = paper::has_prediction(params) ? 0 : std::numeric_limits<double>::quiet_NaN();
        for (const auto& u :
             paper::simulate(chosen, params, [&](const paper::Update& u) { call.check(u.time_s / duration_s); })) {
            const auto& real = u.real.position;
            const auto& [e, turn] = u.measured;
            columns.insert(columns.end(),
                           {u.time_s, real.range_m, real.azimuth_rad, real.elevation_rad, e.range_m, u.predicted.range_m + none,
                            e.azimuth_rad, u.predicted.azimuth_rad + none, e.elevation_rad, u.predicted.elevation_rad + none,
                            turn.azimuth_rad, turn.elevation_rad, turn.roll_rad, u.position_error_m.norm()});
        }
    }
    constexpr py::ssize_t kColumns = 14;
    return Array({static_cast<py::ssize_t>(columns.size()) / kColumns, kColumns}, columns.data());
}

/// motion: (N, 19): position, quaternion (w, x, y, z), velocity, angular rate, acceleration, angular acceleration. column_age_s:
/// (N, 3). Result: (N, 5, 6), true minus measured: linearization, frame propagation, skew, blur, latency.
Array systematic_errors(const Array& motion, const Array& column_age_s, double update_s, double window_s, double latency_s,
                        const std::string& solver) {
    error_model::BudgetParams<double> params;
    params.solver =
        static_cast<error_model::SolverForm>(host::index_of_name("solver", solver, {"direct", "previous", "previous-angles"}));
    params.timing.update_s = update_s;
    params.timing.window_s = window_s;
    params.timing.latency_s = latency_s;
    Array result({motion.shape(0), py::ssize_t{5}, py::ssize_t{6}});
    double* out = result.mutable_data();
    const py::gil_scoped_release released;
    for (py::ssize_t n = 0; n < motion.shape(0); ++n) {
        const double* const m = motion.data() + 19 * n;
        const auto vector = [m](int at) { return Vec3<double>(m + at); };
        const Quat<double> q = Quat<double>(m[3], m[4], m[5], m[6]).normalized();
        params.timing.column_age_s = Vec3<double>(column_age_s.data() + 3 * n);
        const auto errors =
            error_model::systematic_errors<double>({vector(0), q, vector(7), vector(10), vector(13), vector(16)}, params);
        for (const auto* term : {&errors.linearization, &errors.frame_propagation, &errors.skew, &errors.blur, &errors.latency}) {
            copy_rows(*term, out);
            out += 6;
        }
    }
    return result;
}

/// Errors (true minus measured) of the previous-measurement technique along a path, (19)-(37). path_m, result: (N, 3).
Array accumulated_error(const Array& path_m, const std::string& kappa, const std::string& loop) {
    const auto form = static_cast<error_model::KappaForm>(host::index_of_name("kappa", kappa, {"exact", "paper", "two"}));
    const auto how = static_cast<error_model::Loop>(host::index_of_name("loop", loop, {"open", "closed"}));
    Array result({path_m.shape(0), py::ssize_t{3}});
    if (path_m.shape(0) == 0) {
        return result;
    }
    auto real = geometry::to_spherical(Vec3<double>(path_m.data()));
    error_model::AccumulatedError<double> accumulated(form, how, real);
    for (py::ssize_t n = 0; n < path_m.shape(0); ++n) {
        auto now = geometry::to_spherical(Vec3<double>(path_m.data(n)));
        now.azimuth_rad = real.azimuth_rad + std::remainder(now.azimuth_rad - real.azimuth_rad, 2 * std::numbers::pi);
        const auto& e = accumulated.update(real = now);
        const auto apart = error_model::cartesian_error(real, {e.range_m, e.azimuth_rad, e.elevation_rad});
        std::copy_n(apart.data(), 3, result.mutable_data(n));
    }
    return result;
}

}  // namespace

void add_motion(py::module_& module) {
    module.def("motion", motion);
    module.def("accumulated_error", accumulated_error);
    module.def("systematic_errors", systematic_errors);
}

}  // namespace tricoil::python
