// File of the tip of a pointer.
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/output_file.hpp"
#include "board/support/tool_tip.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

void write_tip(const std::string& out, std::uint8_t sensor, const Array& tip_m, const Array& covariance_m2) {
    host::write_whole_file(out, host::to_toml({sensor, Vec3<double>(tip_m.data()), Mat3<double>(covariance_m2.data())}));
}

}  // namespace

void add_pivot(py::module_& module) { module.def("write_tip", write_tip); }

}  // namespace tricoil::python
