// Commands of the `tricoil` program, in this process, and files that commands in Python read and write.
#include <pybind11/stl.h>

#include "board/host/commands/commands.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/wiring_file.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

constexpr host::OwnCommand kOwn[] = {
    {"run", host::add_run_command},
    {"serve", host::add_serve_command},
#ifdef TRICOIL_WITH_WEB
    {"demo", host::add_demo_command},
#endif
    {"replay", host::add_replay_command},
    {"smooth", host::add_smooth_command},
    {"convert", host::add_convert_command},
    {"plot", host::add_python_command},
#ifdef TRICOIL_WITH_CALIBRATION
    {"calibrate", host::add_calibrate_command, host::renew_calibrate},
    {"evaluate", host::add_evaluate_command},
#endif
    {"couplings", host::add_python_command},
    {"bench", host::add_python_command},
    {"demodulate", host::add_python_command},
    {"design", host::add_python_command},
    {"truth", host::add_python_command},
    {"generator", host::add_python_command},
    {"device", host::add_device_command},
    {"doctor", host::add_doctor_command},
    {"selfcheck", host::add_selfcheck_command},
    {"protocol", host::add_protocol_command},
    {"motion", host::add_motion_command},
    {"figures", host::add_python_command},
    {"help", host::add_help_command},
    {"completion", host::add_completion_command},
};

/// Exit code, and the text that the command printed.
py::tuple command(const std::vector<std::string>& arguments) {
    int code = 0;
    std::string text;
    try {
        const py::gil_scoped_release released;
        const host::BorrowedInterrupt interrupt(has_raised);
        const host::CapturedText captured;
        code = host::run_program(arguments, kOwn);
        text = captured.text();
    } catch (const host::Interrupted&) {  // Python's exception is set
    }
    throw_if_raised();
    return py::make_tuple(code, text);
}

/// Coils of the channels of the sensor and of the source: 1 to 3, negative if reversed.
std::array<std::array<int, 3>, 2> read_wiring(const std::string& path) {
    host::refuse_if(path.empty(), "the name of the wiring file is empty");
    const host::ChannelWiring wiring = host::read_wiring(path);
    std::array<std::array<int, 3>, 2> numbers{};
    for (std::size_t n = 0; n < 3; ++n) {
        numbers[0][n] = wiring.sensor.sign[n] * (wiring.sensor.coil[n] + 1);
        numbers[1][n] = wiring.source.sign[n] * (wiring.source.coil[n] + 1);
    }
    return numbers;
}

void write_tip(const std::string& out, std::uint8_t sensor, const Array& tip_m, const Array& covariance_m2) {
    host::write_whole_file(out, host::to_toml({sensor, Vec3<double>(tip_m.data()), Mat3<double>(covariance_m2.data())}));
}

}  // namespace

void add_command(py::module_& module) {
    module.def("command", command);
    module.def("read_wiring", read_wiring);
    module.def("write_tip", write_tip);
}

}  // namespace tricoil::python
