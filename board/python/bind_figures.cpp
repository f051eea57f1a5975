// Data of the command `figures`.
#include <pybind11/complex.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "core/solver/direct.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/world/metal/metal_set.hpp"
#include "sim/world/metal/sphere.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

constexpr double kCarrier_hz = 10e3;
constexpr double kGenerated_s = 5;

/// Moment of a sphere by frequency, by the name of its material; that of a perfect conductor of its size is -1.
py::dict sphere_response(const Array& frequency_hz, double radius_m) {
    py::dict responses;
    for (const sim::NamedMaterial& metal : sim::materials()) {
        py::array_t<std::complex<double>> response(frequency_hz.size());
        std::transform(frequency_hz.data(), frequency_hz.data() + frequency_hz.size(), response.mutable_data(), [&](double hz) {
            return 2.0 * sim::sphere_polarisability({radius_m}, metal.material, hz) / std::pow(radius_m, 3);
        });
        responses[py::str(metal.name)] = response;
    }
    return responses;
}

/// Position error of the direct solution at 10 kHz, and the distortion that trackers report without noise, m: (N, 2). The sphere
/// is at each of places_m (N, 3).
Array sphere_errors(const std::string& material, double radius_m, const Array& places_m, const Array& sensor_m) {
    const Vec3<double> sensor(sensor_m.data());
    const auto metal = std::ranges::find(sim::materials(), material, &sim::NamedMaterial::name);
    host::refuse_if(metal == sim::materials().end(), "unknown material {}", material);
    Array errors({places_m.shape(0), py::ssize_t{2}});
    for (py::ssize_t n = 0; n < places_m.shape(0); ++n) {
        sim::MetalSet set;
        set.add({sim::Sphere{radius_m}, metal->material, {Vec3<double>(places_m.data(n)), Quat<double>::Identity()}}, 0, 1);
        set.tune({kCarrier_hz});
        const Mat3<double> field = sim::unit_dipole_field(sensor) + set.field(sensor, 0, 0)[0].real();
        const auto solution = solver::solve_direct<double>(0.5 * field, 1);  // coupling constant 1 m^3: (6) with unit moments
        const double hidden = tracking::kHiddenShare * std::sqrt(solution->misfit_squared / 3);
        errors.mutable_at(n, 0) = (solution->position_towards(sensor) - sensor).norm();
        errors.mutable_at(n, 1) = tracking::likely_distortion(solution->strength, solution->range_m, hidden);
    }
    return errors;
}

/// Poses along a .traj file, or a generated motion if `file` is empty: three for each slot, step_s before its time, at it and
/// after it.
py::array_t<TruthRow> motion_poses(const std::string& file, std::uint64_t seed, double slot_s, double step_s) {
    const py::gil_scoped_release released;
    std::vector<TruthRow> rows;
    const auto add = [&](const sim::Motion& motion, double duration_s) {
        for (int n = 0; n < static_cast<int>(duration_s / slot_s); ++n) {
            for (const double offset_s : {-step_s, 0.0, step_s}) {
                rows.push_back(to_row(motion.at(n * slot_s + offset_s)));
            }
        }
    };
    if (file.empty()) {
        add(sim::HandMotion(Vec3<double>(0.9, 0, 0), seed), kGenerated_s);
    } else {
        const sim::RecordedMotion motion(host::read_trajectory(file), sim::RecordedMotionParams{});
        add(motion, motion.duration_s());
    }
    const py::gil_scoped_acquire acquired;
    return to_array(std::move(rows));
}

}  // namespace

void add_figures(py::module_& module) {
    module.def("sphere_errors", sphere_errors);
    module.def("sphere_response", sphere_response);
    module.def("motion_poses", motion_poses);
}

}  // namespace tricoil::python
