// Simulated runs.
#include <pybind11/stl.h>

#include "board/host/run/report.hpp"
#include "board/host/run/simulated_run.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/tracker_choice.hpp"

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
        .def_property("place_m", nullptr,
                      [](host::RunOptions& o, const std::array<double, 3>& p) { o.place_m = Vec3<double>(p.data()); })
        .def_readwrite("speed", &host::RunOptions::speed)
        .def_readwrite("mux", &host::RunOptions::multiplexing)
        .def_readwrite("tracker", &host::RunOptions::tracker)
        .def_readwrite("passes", &host::RunOptions::passes)
        .def_readwrite("rate_hz", &host::RunOptions::frame_rate_hz)
        .def_readwrite("duration_s", &host::RunOptions::duration_s)
        .def_readwrite("faults", &host::RunOptions::faults)
        .def_readwrite("hemisphere", &host::RunOptions::hemisphere)
        .def_readwrite("confined", &host::RunOptions::confined)
        .def_readwrite("predict_s", &host::RunOptions::predict_ahead_s)
        .def_readwrite("seed", &host::RunOptions::seed)
        .def_readwrite("fidelity", &host::RunOptions::fidelity)
        .def_readwrite("record", &host::RunOptions::record)
        .def_readwrite("progress", &host::RunOptions::show_live)
        .def_readwrite("no_noise", &host::RunOptions::no_noise)
        .def_readwrite("no_deskew", &host::RunOptions::no_deskew);
    module.def("acquisition", [](const std::string& mux, double rate_hz) {  // window, s; frequencies of the carriers, Hz
        const auto plan = signal::plan_acquisition(signal::default_acquisition(host::multiplexing_of_name(mux), rate_hz));
        host::refuse_if(!plan.ok(), "--rate-hz {}: {}", rate_hz, plan.status().message());
        return py::make_tuple(plan->window_s(), plan->params.carrier_hz);
    });
    module.def("run", [](const host::RunOptions& options) {
        RunTable table = run_table(options);
        return py::make_tuple(to_array(std::move(table.poses)), to_array(std::move(table.truth)), table.summary);
    });
}

}  // namespace tricoil::python
