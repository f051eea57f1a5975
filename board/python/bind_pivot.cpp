// Tip of a pointer from poses in arrays.
#include "board/host/calibration/pivot.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// position_m: (N, 3); wxyz: (N, 4), any length; covariance: (N, 6, 6). Result: JSON.
std::string pivot(const Array& position_m, const Array& wxyz, const Array& covariance, std::uint8_t sensor, std::size_t invalid,
                  const std::string& out) {
    host::PivotRecord record{"poses", sensor, {}, invalid};
    for (py::ssize_t n = 0; n < position_m.shape(0); ++n) {
        const double* const q = wxyz.data() + 4 * n;
        record.poses.push_back({Vec3<double>(position_m.data() + 3 * n), Quat<double>(q[0], q[1], q[2], q[3]).normalized(),
                                Mat6<double>(covariance.data() + 36 * n)});
    }
    const py::gil_scoped_release released;
    return host::pivot_result(record, out).dump();
}

}  // namespace

void add_pivot(py::module_& module) { module.def("pivot", pivot); }

}  // namespace tricoil::python
