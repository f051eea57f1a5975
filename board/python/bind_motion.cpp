// The error model: the paper's examples, and systematic errors of poses.
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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
#include "sim/paper/singularities.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// A motion of the paper, or own rates if `name` is empty. rates: A and B of (40), which replace those of the example.
paper::Example example_of(const std::string& name, const std::map<std::string, std::array<double, 2>>& rates,
                          double start_range_m) {
    const auto& names = paper::example_names();
    paper::Example example;
    if (!name.empty()) {
        example = paper::example(names[host::index_of_name("example", name, names)]);
    }
    for (const auto& [of, ab] : rates) {
        if (of == "range") {
            example.range = {ab[1], ab[0], 10 * std::numbers::pi};  // (40): the range's frequency is fixed
        } else {
            (of == "azimuth"     ? example.azimuth
             : of == "elevation" ? example.elevation
                                 : example.attitude) = paper::paper_angle_rate(ab[0], ab[1]);
        }
    }
    example.start.range_m = start_range_m;
    return example;
}

error_model::KappaForm kappa_of(const std::string& name) {
    return static_cast<error_model::KappaForm>(host::index_of_name("kappa", name, {"exact", "paper", "two"}));
}

void append(std::vector<double>& columns, const paper::Update& u) {
    const auto add = [&](std::initializer_list<double> numbers) { columns.insert(columns.end(), numbers); };
    const auto& real = u.real.position;
    const auto& [e, turn] = u.measured;
    const auto& exact = u.exact.position;
    add({u.time_s, static_cast<double>(to_us(u.stamp)), real.range_m, real.azimuth_rad, real.elevation_rad});
    add({e.range_m, u.predicted.range_m, exact.range_m});
    add({e.azimuth_rad, u.predicted.azimuth_rad, exact.azimuth_rad});
    add({e.elevation_rad, u.predicted.elevation_rad, exact.elevation_rad});
    add({u.measured_azimuth_rate_error_rad_s, u.predicted_azimuth_rate_error_rad_s});
    add({turn.azimuth_rad, turn.elevation_rad, turn.roll_rad});
    add({u.position_error_m.norm(), u.predicted_position_error_m.norm(), u.rotation_error_rad});
}
constexpr py::ssize_t kColumns = 22;

/// Singular instants are predicted for the angle form with one pass; the pole-free form has none.
py::object singularities(const std::vector<paper::Update>& updates, const paper::SimulationParams& params) {
    using namespace py::literals;
    if (params.form != paper::Form::angles || !paper::has_prediction(params)) {
        return py::none();
    }
    const auto found = paper::compare_singularities(updates, params.update_s);
    return py::dict("predicted"_a = found.predicted_s.size(), "measured_passages"_a = found.passages_s.size(),
                    "measured_jumps"_a = found.jumps_s.size(), "hits"_a = found.hits, "missed"_a = found.missed,
                    "false_alarms"_a = found.false_alarms, "worst_hit_distance_s"_a = found.worst_distance_s,
                    "predicted_s"_a = found.predicted_s, "jumps_s"_a = found.jumps_s);
}

/// azimuth_kappa: of the azimuth, if it differs; empty: kappa. attitude_factor: of the amplitude of (41). Returns the columns of
/// the updates, which _motion.py names, and the singular instants or None.
py::tuple motion(const std::string& example, const std::map<std::string, std::array<double, 2>>& rates, double start_range_m,
                 const std::string& loop, const std::string& form, const std::string& kappa, const std::string& azimuth_kappa,
                 int passes, double update_s, double duration_s, double start_s, double attitude_factor,
                 const py::object& progress) {
    LongCall call(progress);
    paper::Example chosen = example_of(example, rates, start_range_m);
    chosen.attitude.amplitude *= attitude_factor;
    paper::SimulationParams params;
    params.loop = static_cast<error_model::Loop>(host::index_of_name("loop", loop, {"open", "closed"}));
    params.form = static_cast<paper::Form>(host::index_of_name("form", form, {"angles", "vectors"}));
    params.kappa = kappa_of(kappa);
    params.azimuth_kappa = kappa_of(azimuth_kappa.empty() ? kappa : azimuth_kappa);
    params.passes = passes;
    params.update_s = update_s;
    params.duration_s = duration_s;
    params.start = DeviceTime{microseconds_from_seconds(start_s)};
    std::vector<paper::Update> updates;
    {
        const py::gil_scoped_release released;
        updates = paper::simulate(chosen, params, [&](const paper::Update& u) { call.check(u.time_s / duration_s); });
    }
    std::vector<double> columns;
    for (const paper::Update& update : updates) {
        append(columns, update);
    }
    return py::make_tuple(Array({static_cast<py::ssize_t>(updates.size()), kColumns}, columns.data()),
                          singularities(updates, params));
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
