// Forward model and direct solver on arrays.
#include <algorithm>
#include <limits>

#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using RowMajor3 = Matrix<double, 3, 3, Order::by_rows>;

constexpr double kNoiseGate = 16.27;  // chi-square of three degrees of freedom, exceeded once in 1,000 poses

SolutionRow unsolved() {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    SolutionRow row;
    put(Vec3<double>::Constant(kNaN), row.position_m);
    put(Quat<double>(kNaN, kNaN, kNaN, kNaN), row.quaternion_wxyz);
    put(Mat6<double>::Constant(kNaN), row.covariance);
    row.chi_square = kNaN;
    row.solved = false;
    return row;
}

/// With coils of any kind.
SolutionRow calibrated_row(const Mat3<double>& x, double sigma, const calibration::Calibration<double>& c,
                           const Vec3<double>& hemisphere) {
    solver::ColdStartParams<double> params;
    params.hemisphere = hemisphere;
    params.refine.noise_gate = kNoiseGate;
    const Mat3<double> weights = Mat3<double>::Constant(1 / sigma);
    const auto solution = solver::solve_cold<double>(c.model, x, weights, params);
    if (!solution.ok() || !solution->right_handed || !solution->refinement.converged()) {
        return unsolved();
    }
    const auto refined = solver::refine<double>(c.model, x, weights, solution->refinement.pose, params.refine);
    if (!refined.ok()) {
        return unsolved();
    }
    SolutionRow row;
    row.solved = true;
    put(calibration::CoilCorrection<double>::phases(c).corrected_position(refined->pose.position_m), row.position_m);
    put(refined->pose.q_source_sensor, row.quaternion_wxyz);
    put(refined->covariance, row.covariance);
    row.chi_square = refined->misfit_squared;
    return row;
}

SolutionRow solve_row(const Mat3<double>& x, double sigma, double coupling_constant, const Vec3<double>& hemisphere) {
    SolutionRow row;
    const auto solution = solver::solve_direct<double>(x, coupling_constant);
    row.solved = solution.ok() && solution->right_handed;
    if (!row.solved) {
        return unsolved();
    }
    const Vec3<double> u = solution->direction.dot(hemisphere) < 0 ? Vec3<double>(-solution->direction) : solution->direction;
    put(solution->range_m * u, row.position_m);
    put(Quat<double>(solution->attitude.transpose()), row.quaternion_wxyz);
    put(solver::pose_covariance<double>(solution->strength, solution->range_m, u, sigma), row.covariance);
    row.chi_square = solution->misfit_squared / (sigma * sigma);
    return row;
}

/// x: (N, 3, 3); sigma: (N); hemisphere: (3), zero: that of the calibration.
py::array_t<SolutionRow> solve(const Array& x, const Array& sigma, double coupling_constant, const Array& hemisphere,
                               const std::string& calibration_file, const py::object& progress) {
    const auto calibration = calibration_of(calibration_file);
    py::array_t<SolutionRow> rows(x.shape(0));
    SolutionRow* const out = rows.mutable_data();
    const double* const matrices = x.data();
    const double* const sigmas = sigma.data();
    const Vec3<double> given(hemisphere.data());
    const Vec3<double> towards = given.isZero(0) && calibration ? calibration->hemisphere : given;
    for_rows(x.shape(0), progress, [&](py::ssize_t n) {
        const RowMajor3 x_n(matrices + 9 * n);
        out[n] = calibration ? calibrated_row(Mat3<double>(x_n) - calibration->pick_up.in_phase, sigmas[n], *calibration, towards)
                             : solve_row(x_n, sigmas[n], coupling_constant, towards);
    });
    return rows;
}

/// Previous-measurement technique, pole-free. x: (N, 3, 3); position_m, wxyz: previous poses, (N, 3), (N, 4). Covariance and
/// chi_square are NaN.
py::array_t<SolutionRow> step(const Array& x, const Array& position_m, const Array& wxyz, double coupling_constant, int passes) {
    py::array_t<SolutionRow> rows(x.shape(0));
    SolutionRow* const out = rows.mutable_data();
    for_rows(x.shape(0), py::none(), [&](py::ssize_t n) {
        const Vec3<double> p(position_m.data() + 3 * n);
        const double* const q = wxyz.data() + 4 * n;
        const Mat3<double> o = Quat<double>(q[0], q[1], q[2], q[3]).normalized().conjugate().toRotationMatrix();
        const auto next =
            solver::step_vectors<double>(RowMajor3(x.data() + 9 * n), coupling_constant, {p.norm(), p.normalized(), o}, passes);
        out[n] = unsolved();
        if (next.ok()) {
            out[n].solved = true;
            put(next->range_m * next->direction, out[n].position_m);
            put(Quat<double>(next->attitude.transpose()), out[n].quaternion_wxyz);
        }
    });
    return rows;
}

/// position_m: (N, 3); wxyz: (N, 4), any length. Result: (N, 3, 3).
Array couplings(const Array& position_m, const Array& wxyz, double coupling_constant, const std::string& calibration_file) {
    const auto calibration = calibration_of(calibration_file);
    const py::ssize_t count = position_m.shape(0);
    Array result({count, py::ssize_t{3}, py::ssize_t{3}});
    double* const out = result.mutable_data();
    const double* const positions = position_m.data();
    const double* const quaternions = wxyz.data();
    for_rows(count, py::none(), [&](py::ssize_t n) {
        const double* const q = quaternions + 4 * n;
        const Mat3<double> o = Quat<double>(q[0], q[1], q[2], q[3]).normalized().conjugate().toRotationMatrix();
        const Vec3<double> position(positions + 3 * n);
        copy_rows(calibration ? field::signal_matrix<double>(calibration->model, position, o)
                              : field::signal_matrix<double>(coupling_constant, position, o),
                  out + 9 * n);
    });
    return result;
}

}  // namespace

void add_solver(py::module_& module) {
    module.def("solve", solve);
    module.def("step", step);
    module.def("couplings", couplings);
}

}  // namespace tricoil::python
