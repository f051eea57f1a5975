// Tip of a pointer: its poses in a file, and the file of the tip.
#include <pybind11/stl.h>

#include <algorithm>

#include "board/host/calibration/pivot_poses.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/output_file.hpp"
#include "board/support/tool_tip.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// Number of the sensor, number of invalid poses, and of the others positions (N, 3), quaternions wxyz (N, 4) and covariances
/// (N, 6, 6).
py::tuple pivot_poses(const std::string& path, std::optional<std::uint8_t> sensor) {
    host::PivotRecord record;
    {
        const py::gil_scoped_release released;
        record = host::read_pivot_poses(path, sensor);
    }
    const auto count = static_cast<py::ssize_t>(record.poses.size());
    Array position_m({count, py::ssize_t{3}});
    Array wxyz({count, py::ssize_t{4}});
    Array covariance({count, py::ssize_t{6}, py::ssize_t{6}});
    for (py::ssize_t n = 0; n < count; ++n) {
        const host::PivotPose& pose = record.poses[static_cast<std::size_t>(n)];
        const Quat<double>& q = pose.q_source_sensor;
        copy_rows(pose.position_m, position_m.mutable_data(n, 0));
        std::ranges::copy(std::array{q.w(), q.x(), q.y(), q.z()}, wxyz.mutable_data(n, 0));
        copy_rows(pose.covariance, covariance.mutable_data(n, 0, 0));
    }
    return py::make_tuple(record.sensor, record.invalid, position_m, wxyz, covariance);
}

void write_tip(const std::string& out, std::uint8_t sensor, const Array& tip_m, const Array& covariance_m2) {
    host::write_whole_file(out, host::to_toml({sensor, Vec3<double>(tip_m.data()), Mat3<double>(covariance_m2.data())}));
}

}  // namespace

void add_pivot(py::module_& module) {
    module.def("pivot_poses", pivot_poses);
    module.def("write_tip", write_tip);
}

}  // namespace tricoil::python
