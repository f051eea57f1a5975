// Sensor of one coil in the field of a generator: couplings and poses.
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "core/solver/single_coil.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

constexpr py::ssize_t kCoilNumbers = 7;  // position, moment, octupole
constexpr py::ssize_t kColdChunk = 64;   // a cold start takes about 0.1 ms

/// rows: (N, 7), N at most 16.
field::Generator<double> generator_of(const Array& rows) {
    field::Generator<double> generator;
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        const double* const row = rows.data() + kCoilNumbers * i;
        if (!generator.push_back({Vec3<double>(row), Vec3<double>(row + 3), row[6]})) {
            throw py::value_error("a generator has at most 16 coils");
        }
    }
    return generator;
}

SingleCoilRow row_of(const solver::SingleCoilSolution<double>& solution) {
    SingleCoilRow row;
    put(solution.pose.position_m, row.position_m);
    put(solution.pose.sensitivity.normalized(), row.axis);
    row.gain = solution.pose.sensitivity.norm();
    row.gain_deviation = solution.gain_deviation;
    put(solution.covariance, row.covariance);
    row.chi_square = solution.chi_square;
    row.end = static_cast<std::uint8_t>(solution.end);
    return row;
}

/// coils: (N, 7); couplings, weights: (M, N). follow: starts at the last pose, if there is one. Throws ValueError of the first
/// row.
py::array_t<SingleCoilRow> solve_single_coil(const Array& coils, const Array& couplings, const Array& weights, double gain,
                                             double gain_deviation, const Array& side, double max_misfit_share, bool follow,
                                             const py::object& progress) {
    const field::Generator<double> generator = generator_of(coils);
    solver::SingleCoilParams<double> params;
    params.gain = gain;
    params.gain_deviation = gain_deviation;
    params.side = Vec3<double>(side.data());
    params.max_misfit_share = max_misfit_share;
    py::array_t<SingleCoilRow> rows(couplings.shape(0));
    SingleCoilRow* const out = rows.mutable_data();
    const double* const c = couplings.data();
    const double* const w = weights.data();
    const std::size_t n = generator.size();
    Status failed;
    Vec3<double> last_m;
    bool has_last = false;
    for_rows(
        couplings.shape(0), progress,
        [&](py::ssize_t m) {
            const std::span<const double> c_m(c + static_cast<std::size_t>(m) * n, n);
            const std::span<const double> w_m(w + static_cast<std::size_t>(m) * n, n);
            if (has_last) {
                const auto next = solver::refine_single_coil<double>(generator, c_m, w_m, last_m, params);
                has_last = next.ok() && next->converged();
                if (has_last) {
                    last_m = next->pose.position_m;
                    out[m] = row_of(*next);
                    return;
                }
            }
            const auto found = solver::solve_single_coil<double>(generator, c_m, w_m, params);
            if (!found.ok()) {
                failed = failed.ok() ? found.status() : failed;
                return;
            }
            has_last = follow && found->converged();
            last_m = found->pose.position_m;
            out[m] = row_of(*found);
        },
        kColdChunk);
    if (!failed.ok()) {
        throw py::value_error(failed.message());
    }
    return rows;
}

/// position_m, sensitivity: (M, 3). Result: (M, N, 7): coupling, its gradients with respect to position and sensitivity.
Array generator_couplings(const Array& coils, const Array& position_m, const Array& sensitivity) {
    const field::Generator<double> generator = generator_of(coils);
    const auto n = static_cast<py::ssize_t>(generator.size());
    Array result({position_m.shape(0), n, kCoilNumbers});
    double* out = result.mutable_data();
    for (py::ssize_t m = 0; m < position_m.shape(0); ++m) {
        for (const auto& coil : generator) {
            const auto x = field::coil_coupling<double>(coil, Vec3<double>(position_m.data() + 3 * m),
                                                        Vec3<double>(sensitivity.data() + 3 * m));
            *out++ = x.value;
            for (const Vec3<double>& gradient : {x.by_displacement_per_m, x.by_sensitivity}) {
                out = std::copy_n(gradient.data(), 3, out);
            }
        }
    }
    return result;
}

}  // namespace

void add_generator(py::module_& module) {
    module.def("solve_single_coil", solve_single_coil);
    module.def("generator_couplings", generator_couplings);
}

}  // namespace tricoil::python
