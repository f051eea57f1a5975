// The error model: the paper's examples, and the budget of one pose.
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
    row.e_psi_rad = update.measured.attitude.azimuth_rad;
    row.e_theta_rad = update.measured.attitude.elevation_rad;
    row.e_phi_rad = update.measured.attitude.roll_rad;
    row.position_error_m = update.position_error_m.norm();
    return row;
}

py::array_t<UpdateRow> motion(const std::string& example, const std::string& loop, const std::string& form,
                              const std::string& kappa, int passes, double rate_hz, double duration_s,
                              const py::object& progress) {
    LongCall call(progress);
    std::vector<UpdateRow> rows;
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
        const auto updates =
            paper::simulate(chosen, params, [&](const paper::Update& update) { call.check(update.time_s / duration_s); });
        for (const paper::Update& update : updates) {
            rows.push_back(row_of(update, paper::has_prediction(params)));
        }
    }
    return to_array(std::move(rows));
}

using Budget = error_model::ErrorBudget<double>;

error_model::MotionState<double> motion_state(const Vector& position_m, const Vector& velocity_m_s,
                                              const Vector& angular_rate_rad_s) {
    error_model::MotionState<double> state;
    state.position_m = Vec3<double>(position_m.data());
    state.velocity_m_s = Vec3<double>(velocity_m_s.data());
    state.angular_rate_rad_s = Vec3<double>(angular_rate_rad_s.data());
    host::refuse_if(!(state.position_m.norm() > 0 && state.position_m.allFinite() && state.velocity_m_s.allFinite() &&
                      state.angular_rate_rad_s.allFinite()),
                    "position_m must not be zero; all vectors must be finite");
    return state;
}

/// One timing for each source coil that can be the newest: in TDM the trackers solve after each column.
std::vector<error_model::BoardTiming<double>> timings(const std::string& mux, double rate_hz) {
    if (host::index_of_name("mux", mux, {"tdm", "fdm"}) != 0) {
        return {error_model::fdm_timing(1 / rate_hz)};
    }
    const double slot_s = 1 / (3 * rate_hz);
    std::vector<error_model::BoardTiming<double>> all;
    for (const auto last : {error_model::LastState::s1, error_model::LastState::s2, error_model::LastState::s3}) {
        all.push_back(error_model::tdm_timing(slot_s, slot_s, last));
    }
    return all;
}

/// RMS of one term.
py::dict term(const std::vector<Budget>& budgets, error_model::ErrorTerm<double> Budget::*which) {
    double position = 0;
    double rotation = 0;
    for (const Budget& budget : budgets) {
        position += std::pow((budget.*which).position_m, 2);
        rotation += std::pow((budget.*which).rotation_rad, 2);
    }
    const auto count = static_cast<double>(budgets.size());
    py::dict dict;
    dict["position_m"] = std::sqrt(position / count);
    dict["rotation_rad"] = std::sqrt(rotation / count);
    return dict;
}

py::dict error_budget(const Vector& position_m, const Vector& velocity_m_s, const Vector& angular_rate_rad_s, double noise_ratio,
                      const std::string& mux, double rate_hz, const std::string& solver, double latency_s) {
    constexpr double kMost = 1e9;
    host::refuse_if(
        !(rate_hz > 0 && rate_hz <= kMost && noise_ratio >= 0 && noise_ratio <= kMost && latency_s >= 0 && latency_s <= kMost),
        "rate_hz must be positive; noise_ratio and latency_s zero or more; all at most 1e9");
    const auto state = motion_state(position_m, velocity_m_s, angular_rate_rad_s);
    error_model::BudgetParams<double> params;
    params.solver =
        static_cast<error_model::SolverForm>(host::index_of_name("solver", solver, {"direct", "previous", "previous-angles"}));
    std::vector<Budget> budgets;
    for (const auto& timing : timings(mux, rate_hz)) {
        params.timing = timing;
        params.timing.latency_s = latency_s;
        budgets.push_back(error_model::error_budget(state, noise_ratio, params));
    }
    py::dict dict;
    dict["linearization"] = term(budgets, &Budget::linearization);
    dict["frame_propagation"] = term(budgets, &Budget::frame_propagation);
    dict["skew"] = term(budgets, &Budget::skew);
    dict["blur"] = term(budgets, &Budget::blur);
    dict["latency"] = term(budgets, &Budget::latency);
    dict["noise"] = term(budgets, &Budget::noise);
    dict["total"] = term(budgets, &Budget::total);
    return dict;
}

/// Errors (true minus measured) of the previous-measurement technique along a path, (19)-(37). path_m, result: (N, 3).
Array accumulated_error(const Array& path_m, const std::string& kappa, const std::string& loop) {
    const auto form = static_cast<error_model::KappaForm>(host::index_of_name("kappa", kappa, {"exact", "paper", "two"}));
    const auto how = static_cast<error_model::Loop>(host::index_of_name("loop", loop, {"open", "closed"}));
    Array result({path_m.shape(0), py::ssize_t{3}});
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
    module.def("error_budget", error_budget);
}

}  // namespace tricoil::python
