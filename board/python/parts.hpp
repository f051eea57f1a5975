// Parts of the extension module. Each adds its functions and classes to the module.
#pragma once

#include <pybind11/pybind11.h>

namespace tricoil::python {

void add_command(pybind11::module_& module);
void add_run(pybind11::module_& module);
void add_source(pybind11::module_& module);
void add_solver(pybind11::module_& module);
void add_tracker(pybind11::module_& module);
void add_motion(pybind11::module_& module);

/// Runs pending Python signal handlers. Throws error_already_set if one raised, for example KeyboardInterrupt.
inline void check_signals() {
    const pybind11::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) {
        throw pybind11::error_already_set();
    }
}

}  // namespace tricoil::python
