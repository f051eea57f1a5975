// Poses one by one: device, simulation or recording.
#include <pybind11/stl.h>

#include <mutex>
#include <type_traits>

#include "board/pose_source/open_source.hpp"
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/record/recording.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

/// A source that several threads may use: each call waits for the others.
class LockedSource {
public:
    LockedSource(const std::string& name, const std::string& tracker) : source_(host::open_source(name, tracker)) {}

    /// One row, or None after timeout_s. Raises EOFError at the end.
    py::object poll(double timeout_s) {
        if (!(timeout_s >= 0)) {
            throw py::value_error("timeout_s must be a number of seconds, 0 or more");
        }
        constexpr double kSlice_s = 0.05;  // signals are checked this often
        for (double left_s = timeout_s;; left_s -= kSlice_s) {
            tracking::PoseEstimate<double> estimate;
            switch (poll_slice(std::min(std::max(left_s, 0.0), kSlice_s), estimate)) {
                case host::PoseSource::Event::pose:
                    return to_array(std::vector<PoseRow>{to_row(estimate)})[py::int_(0)];
                case host::PoseSource::Event::end:
                    PyErr_SetString(PyExc_EOFError, "the simulation or recording has ended");
                    throw py::error_already_set();
                case host::PoseSource::Event::none:
                    break;
            }
            check_signals();
            if (left_s <= kSlice_s) {
                return py::none();
            }
        }
    }

    std::string status() {
        return locked([](host::PoseSource& source) { return source.status(); });
    }
    std::uint64_t dropped() {
        return locked([](host::PoseSource& source) { return source.dropped(); });
    }
    void set_hemisphere(std::size_t sensor, const std::array<double, 3>& towards) {
        expect(locked([&](host::PoseSource& source) { return source.set_hemisphere(sensor, Vec3<double>(towards.data())); }),
               "hemisphere: give a sensor 0 to 3 that exists and a finite direction other than zero; the source must not be a "
               "recording");
    }
    void set_tip(std::size_t sensor, const std::array<double, 3>& tip_m, const Array& covariance_m2) {
        const Vec3<double> tip(tip_m.data());
        const Mat3<double> covariance(covariance_m2.data());
        expect(locked([&](host::PoseSource& source) { return source.set_tip(sensor, tip, covariance); }),
               "tip: give a sensor 0 to 3 and finite numbers");
    }
    void boresight(std::size_t sensor) {
        expect(locked([&](host::PoseSource& source) { return source.boresight(sensor); }),
               "boresight: the last polled pose of this sensor is not valid, or there is none");
    }
    void close() {
        const py::gil_scoped_release released;
        const std::lock_guard lock(mutex_);
        source_.reset();
    }

private:
    static void expect(bool ok, const char* message) {
        if (!ok) {
            throw py::value_error(message);
        }
    }

    template <typename Function>
    std::invoke_result_t<Function, host::PoseSource&> locked(Function function) {
        const py::gil_scoped_release released;
        const std::lock_guard lock(mutex_);
        if (!source_) {
            throw std::invalid_argument("the source is closed");
        }
        return function(*source_);
    }

    host::PoseSource::Event poll_slice(double patience_s, tracking::PoseEstimate<double>& estimate) {
        return locked([&](host::PoseSource& source) { return source.poll(microseconds_from_seconds(patience_s), estimate); });
    }

    std::mutex mutex_;
    std::unique_ptr<host::PoseSource> source_;  // empty: closed
};

py::array_t<PoseRow> load(const std::string& folder) {
    LongCall call;
    std::vector<PoseRow> rows;
    {
        const py::gil_scoped_release released;
        const host::Recording recording(folder, [&] { call.check(); });
        host::RecordLines lines(folder, host::RecordFile::poses);
        for (std::string line; lines.next(line);) {
            rows.push_back(to_row(host::parse_pose(line, lines.where())));
            call.check();
        }
    }
    return to_array(std::move(rows));
}

}  // namespace

void add_source(py::module_& module) {
    py::class_<LockedSource>(module, "Source")
        .def(py::init<const std::string&, const std::string&>(), py::call_guard<py::gil_scoped_release>())
        .def("poll", &LockedSource::poll)
        .def("status", &LockedSource::status)
        .def("dropped", &LockedSource::dropped)
        .def("set_hemisphere", &LockedSource::set_hemisphere)
        .def("set_tip", &LockedSource::set_tip)
        .def("boresight", &LockedSource::boresight)
        .def("close", &LockedSource::close);
    module.def("load", load);
}

}  // namespace tricoil::python
