// The error model: the paper's examples, and the budget of one pose.
#include <pybind11/stl.h>

#include <limits>

#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "core/error_model/error_budget.hpp"
#include "sim/paper/paper_simulation.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using Vector = std::array<double, 3>;

UpdateRow row_of(const paper::Update& update, bool has_prediction) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    UpdateRow row;
    row.time_s = update.time_s;
    row.range_m = update.real.position.range_m;
    row.azimuth_rad = update.real.position.azimuth_rad;
    row.elevation_rad = update.real.position.elevation_rad;
    row.e_rho_m[0] = update.measured.position.range_m;
    row.e_alpha_rad[0] = update.measured.position.azimuth_rad;
    row.e_beta_rad[0] = update.measured.position.elevation_rad;
    row.e_rho_m[1] = has_prediction ? update.predicted.range_m : kNaN;
    row.e_alpha_rad[1] = has_prediction ? update.predicted.azimuth_rad : kNaN;
    row.e_beta_rad[1] = has_prediction ? update.predicted.elevation_rad : kNaN;
    row.position_error_m = update.position_error_m.norm();
    return row;
}

py::array_t<UpdateRow> motion(const std::string& example, const std::string& loop, const std::string& form, int passes,
                              double rate_hz, double duration_s) {
    std::vector<UpdateRow> rows;
    {
        const py::gil_scoped_release released;
        const auto& names = paper::example_names();
        const paper::Example chosen = paper::example(names[host::index_of_name("example", example, names)]);
        if (!(rate_hz >= 1 && rate_hz <= 1e5)) {
            throw host::InputError("rate_hz must be 1 to 1e5");
        }
        paper::SimulationParams params;
        params.loop = static_cast<error_model::Loop>(host::index_of_name("loop", loop, {"open", "closed"}));
        params.form = static_cast<paper::Form>(host::index_of_name("form", form, {"angles", "vectors"}));
        params.passes = passes;
        params.update_s = 1 / rate_hz;
        params.duration_s = duration_s;
        for (const paper::Update& update : paper::simulate(chosen, params)) {
            rows.push_back(row_of(update, paper::has_prediction(params)));
        }
    }
    return to_array(std::move(rows));
}

py::dict term(const error_model::ErrorTerm<double>& t) {
    py::dict dict;
    dict["position_m"] = t.position_m;
    dict["rotation_rad"] = t.rotation_rad;
    return dict;
}

py::dict error_budget(const Vector& position_m, const Vector& velocity_m_s, const Vector& angular_rate_rad_s, double noise_ratio,
                      const std::string& mux, double rate_hz, const std::string& solver, double latency_s) {
    if (!(rate_hz > 0 && noise_ratio >= 0 && latency_s >= 0)) {
        throw host::InputError("rate_hz must be positive; noise_ratio and latency_s zero or more");
    }
    const std::size_t is_fdm = host::index_of_name("mux", mux, {"tdm", "fdm"});
    error_model::BudgetParams<double> params;
    params.timing =
        is_fdm != 0 ? error_model::fdm_timing(1 / rate_hz) : error_model::tdm_timing(1 / (3 * rate_hz), 1 / (3 * rate_hz));
    params.timing.latency_s = latency_s;
    params.solver =
        static_cast<error_model::SolverForm>(host::index_of_name("solver", solver, {"direct", "previous", "previous-angles"}));
    error_model::MotionState<double> state;
    state.position_m = Vec3<double>(position_m.data());
    state.velocity_m_s = Vec3<double>(velocity_m_s.data());
    state.angular_rate_rad_s = Vec3<double>(angular_rate_rad_s.data());
    if (!(state.position_m.norm() > 0 && state.position_m.allFinite() && state.velocity_m_s.allFinite() &&
          state.angular_rate_rad_s.allFinite())) {
        throw host::InputError("position_m must not be zero; all vectors must be finite");
    }
    const auto budget = error_model::error_budget(state, noise_ratio, params);
    py::dict dict;
    dict["linearization"] = term(budget.linearization);
    dict["frame_propagation"] = term(budget.frame_propagation);
    dict["skew"] = term(budget.skew);
    dict["blur"] = term(budget.blur);
    dict["latency"] = term(budget.latency);
    dict["noise"] = term(budget.noise);
    dict["total"] = term(budget.total);
    return dict;
}

}  // namespace

void add_motion(py::module_& module) {
    module.def("motion", motion);
    module.def("error_budget", error_budget);
}

}  // namespace tricoil::python
