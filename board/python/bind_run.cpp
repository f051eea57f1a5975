// Simulated runs.
#include <pybind11/stl.h>

#include "board/host/run/report.hpp"
#include "board/host/run/simulated_run.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

struct RunTable {
    std::vector<PoseRow> poses;
    std::vector<TruthRow> truth;
    std::string summary;  // JSON
};

RunTable run_table(const host::RunOptions& options) {
    RunTable table;
    {
        const py::gil_scoped_release released;
        const host::BorrowedInterrupt interrupt(has_raised);
        host::RunObservers observers;
        observers.each_pose = [&](const tracking::PoseEstimate<double>& estimate, const host::PoseError& error) {
            table.poses.push_back(to_row(estimate));
            table.truth.push_back(to_row(error.truth));
        };
        const host::RunReport report = host::run_simulated(options, observers);
        if (!report.recording_error.empty()) {
            throw host::DeviceError(report.recording_error);
        }
        table.summary = host::run_result(report).dump();
    }
    throw_if_raised();
    return table;
}

}  // namespace

void add_run(py::module_& module) {
    py::class_<host::RunOptions>(module, "RunOptions")
        .def(py::init<>())
        .def_readwrite("scenario", &host::RunOptions::scenario)
        .def_readwrite("trajectory", &host::RunOptions::trajectory)
        .def_property(
            "place_m",
            [](const host::RunOptions& o) {
                return std::array<double, 3>{o.place_m.x(), o.place_m.y(), o.place_m.z()};
            },
            [](host::RunOptions& o, const std::array<double, 3>& p) { o.place_m = Vec3<double>(p[0], p[1], p[2]); })
        .def_readwrite("speed", &host::RunOptions::speed)
        .def_readwrite("mux", &host::RunOptions::multiplexing)
        .def_readwrite("tracker", &host::RunOptions::tracker)
        .def_readwrite("passes", &host::RunOptions::passes)
        .def_readwrite("rate_hz", &host::RunOptions::frame_rate_hz)
        .def_readwrite("duration_s", &host::RunOptions::duration_s)
        .def_readwrite("faults", &host::RunOptions::faults)
        .def_property(
            "hemisphere", [](const host::RunOptions& o) { return o.hemisphere; },
            [](host::RunOptions& o, const std::array<double, 3>& h) { o.hemisphere.assign(h.begin(), h.end()); })
        .def_readwrite("confined", &host::RunOptions::confined)
        .def_readwrite("predict_s", &host::RunOptions::predict_ahead_s)
        .def_readwrite("seed", &host::RunOptions::seed)
        .def_readwrite("fidelity", &host::RunOptions::fidelity)
        .def_readwrite("record", &host::RunOptions::record)
        .def_readwrite("progress", &host::RunOptions::show_live)
        .def_property(
            "noise", [](const host::RunOptions& o) { return !o.no_noise; },
            [](host::RunOptions& o, bool noise) { o.no_noise = !noise; })
        .def_property(
            "deskew", [](const host::RunOptions& o) { return !o.no_deskew; },
            [](host::RunOptions& o, bool deskew) { o.no_deskew = !deskew; });
    module.def("run", [](const host::RunOptions& options) {
        RunTable table = run_table(options);
        return py::make_tuple(to_array(std::move(table.poses)), to_array(std::move(table.truth)), table.summary);
    });
}

}  // namespace tricoil::python
