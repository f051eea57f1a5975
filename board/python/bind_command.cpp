// Commands of the `tricoil` program, in this process.
#include <pybind11/stl.h>

#include "board/host/program.hpp"
#include "board/python/parts.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// Exit code, and the text that the command printed.
py::tuple command(const std::vector<std::string>& arguments) {
    int code = 0;
    std::string text;
    try {
        const py::gil_scoped_release released;
        const host::BorrowedInterrupt interrupt(has_raised);
        const host::CapturedText captured;
        code = host::run_program(arguments);
        text = captured.text();
    } catch (const host::Interrupted&) {  // Python's exception is set
    }
    throw_if_raised();
    return py::make_tuple(code, text);
}

}  // namespace

void add_command(py::module_& module) { module.def("command", command); }

}  // namespace tricoil::python
