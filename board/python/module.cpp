// Extension module tricoil._tricoil. The package's Python files document and wrap it.
#include <string_view>

#include "board/pose_text/flag_names.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/record/record_lines.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/pose_flags.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::python {
namespace {

/// A message may contain the name of a file, which need not be UTF-8.
void set_error(PyObject* type, const std::exception& error) {
    const std::string_view text = error.what();
    const auto message = pybind11::reinterpret_steal<pybind11::object>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "backslashreplace"));
    PyErr_SetObject(type, message.ptr());
}

void translate_error(std::exception_ptr error) {  // NOLINT(performance-unnecessary-value-param): pybind11's signature
    try {
        if (error) {
            std::rethrow_exception(error);
        }
    } catch (const host::InputError& e) {
        set_error(PyExc_ValueError, e);
    } catch (const host::ReadError& e) {
        set_error(PyExc_OSError, e);
    } catch (const host::DeviceError& e) {
        set_error(PyExc_OSError, e);
    }
}

}  // namespace

PYBIND11_MODULE(_tricoil, module) {
    register_rows();
    pybind11::register_exception_translator(translate_error);
    module.attr("__version__") = TRICOIL_VERSION;
    pybind11::list flags;  // names, in the order of the bits
    for (unsigned bit = 0; (tracking::kAllPoseFlags.bits() >> bit) != 0; ++bit) {
        flags.append(host::to_text(tracking::PoseFlags{static_cast<tracking::PoseFlag>(bit)}));
    }
    module.attr("FLAG_NAMES") = flags;
    module.attr("INVALIDATING_FLAGS") = tracking::kInvalidating.bits();
    module.attr("FAULT_FLAGS") = tracking::kFaultFlags.bits();
    module.attr("MIN_SNR") = tracking::CommonParams<double>{}.min_snr;
    module.attr("MAX_DEVIATION_M") = tracking::CommonParams<double>{}.max_deviation_m;
    module.attr("MAX_MISFIT") = tracking::CommonParams<double>{}.max_misfit;
    module.attr("RECORDED_POSE") = host::record_headers()[static_cast<std::size_t>(host::RecordFile::poses)];
    add_command(module);
    add_figures(module);
    add_generator(module);
    add_run(module);
    add_source(module);
    add_solver(module);
#ifdef TRICOIL_WITH_CALIBRATION
    add_calibrate(module);
    add_bands(module);
    add_evaluate(module);
    add_surroundings(module);
#endif
    add_tracker(module);
    add_motion(module);
}

}  // namespace tricoil::python
