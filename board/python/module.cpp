// Extension module tricoil._tricoil. The package's Python files document and wrap it.
#include "board/pose_text/flag_names.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/record/record_lines.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/pose_flags.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::python {
namespace {

void translate_error(std::exception_ptr error) {  // NOLINT(performance-unnecessary-value-param): pybind11's signature
    try {
        if (error) {
            std::rethrow_exception(error);
        }
    } catch (const host::ReadError& e) {
        PyErr_SetString(PyExc_OSError, e.what());
    } catch (const host::DeviceError& e) {
        PyErr_SetString(PyExc_OSError, e.what());
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
