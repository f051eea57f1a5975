// Parts of the extension module. Each adds its functions and classes to the module.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>

#include "board/support/calibration_file.hpp"

namespace tricoil::python {

/// Content of a file of tricoil calibrate; nothing for an empty name. Throws InputError.
inline std::optional<calibration::Calibration<double>> calibration_of(const std::string& file) {
    return file.empty() ? std::nullopt : std::optional(host::read_coils(file));
}

void add_bands(pybind11::module_& module);      // in builds with calibration
void add_calibrate(pybind11::module_& module);  // in builds with calibration
void add_command(pybind11::module_& module);
void add_evaluate(pybind11::module_& module);  // in builds with calibration
void add_figures(pybind11::module_& module);
void add_generator(pybind11::module_& module);
void add_run(pybind11::module_& module);
void add_source(pybind11::module_& module);
void add_solver(pybind11::module_& module);
void add_surroundings(pybind11::module_& module);  // in builds with calibration
void add_tracker(pybind11::module_& module);
void add_motion(pybind11::module_& module);

/// Asks Python whether a signal handler raised. The exception stays set: call throw_if_raised() afterwards, with the GIL.
inline bool has_raised() {
    const pybind11::gil_scoped_acquire gil;
    return PyErr_CheckSignals() != 0;
}
inline void throw_if_raised() {
    if (PyErr_Occurred() != nullptr) {
        throw pybind11::error_already_set();
    }
}

/// Runs pending Python signal handlers. Throws error_already_set if one raised, for example KeyboardInterrupt.
inline void check_signals() {
    const pybind11::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) {
        throw pybind11::error_already_set();
    }
}

}  // namespace tricoil::python
