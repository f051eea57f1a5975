// Commands of the `tricoil` program, in this process, and files that commands in Python read and write.
#include <pybind11/stl.h>

#include <algorithm>

#include "board/host/commands/commands.hpp"
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/wiring_file.hpp"
#include "core/protocol/can_mapping.hpp"
#include "core/protocol/schema.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

constexpr host::OwnCommand kOwn[] = {
    {"run", host::add_run_command},         {"serve", host::add_serve_command},
#ifdef TRICOIL_WITH_WEB
    {"demo", host::add_demo_command},
#endif
    {"replay", host::add_replay_command},   {"smooth", host::add_smooth_command},
    {"convert", host::add_convert_command}, {"device", host::add_device_command},
    {"doctor", host::add_doctor_command},   {"selfcheck", host::add_selfcheck_command},
    {"help", host::add_help_command},       {"completion", host::add_completion_command},
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

/// The wire protocol, of which `tricoil protocol` makes files.
py::dict protocol_schema() {
    using namespace py::literals;
    constexpr const char* kTypes[] = {"u8", "u16", "u32", "u64", "i16", "i24", "i32", "i64", "u24", "f32"};
    py::list messages;
    protocol::for_each_message([&](auto schema) {
        py::list fields;
        const protocol::FieldInfo* last = nullptr;
        int number = 0;
        protocol::for_each_field(schema, [&](const char* name, const protocol::FieldInfo& f, std::size_t at) {
            number += &f == last ? 0 : 1;  // the elements of a field have the same
            last = &f;
            fields.append(py::dict("name"_a = name, "at"_a = at, "number"_a = number, "type"_a = kTypes[static_cast<int>(f.type)],
                                   "scale"_a = f.scale, "low"_a = f.scale * f.low, "high"_a = f.scale * f.high,
                                   "has_low"_a = f.low != lowest(f.type), "has_high"_a = f.high != highest(f.type),
                                   "unit"_a = f.unit, "what"_a = f.what));
        });
        const auto& info = schema.kInfo;
        const std::size_t bytes = protocol::fixed_bytes(schema);
        messages.append(py::dict("name"_a = info.name, "number"_a = static_cast<int>(info.type), "from"_a = info.from,
                                 "what"_a = info.what, "bytes"_a = bytes, "tail_unit"_a = info.tail_unit,
                                 "tail_what"_a = info.tail_what, "can_id"_a = protocol::can_id(info.type, 0),
                                 "can_bytes"_a = protocol::can_fd_length(std::min(bytes, protocol::kMaxFrameBytes)),
                                 "fields"_a = fields));
    });
    return py::dict("version"_a = protocol::kNewestVersion, "most_bytes"_a = protocol::kMaxMessageBytes, "messages"_a = messages);
}

/// Columns of the first sensor, without those of a fault and of the low band: time_us, coil, gain step, quadratures, levels in
/// 1/65536 of full scale; (N, 9). Throws InputError for a damaged line.
Array recorded_quadratures(const std::string& folder) {
    LongCall call;
    std::vector<std::array<double, 9>> rows;
    host::RecordLines lines(folder, host::RecordFile::inputs);
    for (std::string line; lines.next(line); call.check()) {
        const host::TrackerInput input = host::parse_input(line, lines.where());
        if (const auto& c = input.column; has_couplings(input) && !c.flags.has(ColumnFlag::low_band)) {
            rows.push_back({double(to_us(c.midpoint)), double(coil_index(c.state)), double(c.gain_step), c.quadrature(0),
                            c.quadrature(1), c.quadrature(2), double(c.level[0]), double(c.level[1]), double(c.level[2])});
        }
    }
    return Array({static_cast<py::ssize_t>(rows.size()), py::ssize_t{9}}, rows.empty() ? nullptr : rows.front().data());
}

void write_tip(const std::string& out, std::uint8_t sensor, const Array& tip_m, const Array& covariance_m2) {
    host::write_whole_file(out, host::to_toml({sensor, Vec3<double>(tip_m.data()), Mat3<double>(covariance_m2.data())}));
}

}  // namespace

void add_command(py::module_& module) {
    module.def("command", command);
    module.def("protocol", protocol_schema);
    module.def("read_wiring", read_wiring);
    module.def("write_tip", write_tip);
    module.def("recorded_quadratures", recorded_quadratures);
}

}  // namespace tricoil::python
