// A tracker fed with columns.
#include <pybind11/stl.h>

#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

tracking::TrackerParams<double> make_params(const std::string& method, double coupling_constant,
                                            const std::array<double, 3>& hemisphere, bool confined, double column_span_s,
                                            double window_s, const tracking::AnyTracker::Calibration& calibration) {
    tracking::TrackerParams<double> params;
    params.method = host::method_of_name(method);
    host::refuse_dual_band(params.method, "these columns are of one band; tricoil.run simulates two");
    params.common.coupling_constant = coupling_constant;
    params.common.hemisphere = Vec3<double>(hemisphere.data());
    params.common.confined = confined;
    params.common.max_column_span = microseconds_from_seconds(column_span_s);
    params.common.window_s = window_s;
    host::deskew_in_turn(params);
    if (const Status status = tracking::AnyTracker::check(params, calibration); !status.ok()) {
        throw host::InputError(std::string("tracker: ") + status.message());
    }
    return params;
}

py::object row_or_none(const std::optional<tracking::PoseEstimate<double>>& pose) {
    return pose ? py::object(to_array(std::vector<PoseRow>{to_row(*pose)})[py::int_(0)]) : py::none();
}

class ColumnTracker {
public:
    ColumnTracker(const tracking::TrackerParams<double>& params, const tracking::AnyTracker::Calibration& calibration)
        : tracker_(params, calibration) {}

    py::object update(double time_s, int source_coil, const std::array<double, 3>& couplings,
                      const std::array<double, 3>& sigma) {
        return row_or_none(tracker_.update(column_of(time_s, source_coil, couplings.data(), sigma.data())));
    }

    py::object tick(double time_s) { return row_or_none(tracker_.tick(time_of(time_s))); }

    /// Poses from the columns before and after each, with rates. time_s, source_coil: (N); couplings, sigma: (N, 3).
    py::array_t<SmoothedRow> smooth(const Array& time_s, const py::array_t<int>& source_coil, const Array& couplings,
                                    const Array& sigma) {
        std::vector<SmoothedRow> rows;
        host::Smoother smoother([&](const host::SmoothedPose& pose) { rows.push_back(to_row(pose)); });
        for (py::ssize_t n = 0; n < time_s.shape(0); ++n) {
            const auto column =
                column_of(time_s.data()[n], source_coil.data()[n], couplings.data() + 3 * n, sigma.data() + 3 * n);
            if (const auto estimate = tracker_.update(column)) {
                smoother.add(*estimate, tracker_);
            }
        }
        smoother.finish(tracker_);
        return to_array(std::move(rows));
    }

private:
    Column<double> column_of(double time_s, int source_coil, const double* couplings, const double* sigma) {
        if (source_coil < 0 || source_coil >= kSourceCoils) {
            throw py::value_error("source_coil must be 0, 1 or 2");
        }
        Column<double> column;
        column.state = single_coil(source_coil);
        column.state_sequence = columns_;
        column.sequence = columns_++;
        column.midpoint = time_of(time_s);
        column.in_phase = Vec3<double>(couplings);
        column.sigma = Vec3<double>(sigma);
        return column;
    }

    static DeviceTime time_of(double time_s) {
        constexpr double kLongest_s = 1e9;
        if (!(std::abs(time_s) <= kLongest_s)) {
            throw py::value_error("time_s must be a finite number of seconds");
        }
        return DeviceTime{microseconds_from_seconds(time_s)};
    }

    tracking::AnyTracker tracker_;
    std::uint32_t columns_ = 0;
};

}  // namespace

void add_tracker(py::module_& module) {
    py::class_<ColumnTracker>(module, "Tracker")
        .def(py::init([](const std::string& method, double coupling_constant, const std::array<double, 3>& hemisphere,
                         bool confined, double column_span_s, double window_s, const std::string& calibration_file) {
            auto calibration = calibration_of(calibration_file);
            if (calibration) {  // the columns have no quadratures
                calibration->quadrature_floor = 1;
                calibration->pick_up.quadrature.setZero();
            }
            return std::make_unique<ColumnTracker>(
                make_params(method, coupling_constant, hemisphere, confined, column_span_s, window_s, calibration), calibration);
        }))
        .def("update", &ColumnTracker::update)
        .def("tick", &ColumnTracker::tick)
        .def("smooth", &ColumnTracker::smooth);
}

}  // namespace tricoil::python
