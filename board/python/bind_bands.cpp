// Recorded columns, for `tricoil calibrate low-band` and `pick-up`, and the calibration with what they give.
#include <pybind11/stl.h>

#include <map>

#include "board/host/calibration/calibration_files.hpp"
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/record/recorded_source.hpp"
#include "core/calibration/coil_correction.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using Correction = calibration::CoilCorrection<double>;
using RowMajor3 = Matrix<double, 3, 3, Order::by_rows>;

/// A column of recorded couplings. corrected: high band: by phases alone; low band: without its pick-up. tracked: high band: as a
/// tracker corrects it, with the variance of a coupling's noise.
struct ColumnRow {
    double time_us = 0;
    double coil = 0;
    double low = 0;
    double faulty = 0;
    double variance = 0;
    Vec3<double> in_phase, quadrature;
    Vec3<double> corrected_in_phase, corrected_quadrature;
    Vec3<double> tracked_in_phase, tracked_quadrature;
};
constexpr py::ssize_t kColumnNumbers = 23;
static_assert(sizeof(ColumnRow) == kColumnNumbers * sizeof(double));

class Bands {
public:
    explicit Bands(host::CalibrationFiles files) : files_(std::move(files)) {
        check_files(files_);
        file_ = host::read_calibration(files_.calibration);
    }

    /// Moments of the source and sensitivities of the sensor (2, 3, 3); whether there is pick-up in the high and in the low band.
    [[nodiscard]] py::tuple coils() const {
        const auto& c = file_.calibration;
        const RowMajor3 coils[]{c.model.source_moment, c.model.sensor_sensitivity};
        return py::make_tuple(Array({2, 3, 3}, coils[0].data()), !c.pick_up.is_none(), !c.low_band.pick_up.is_none());
    }

    /// (N, 23) as ColumnRow, of the first sensor.
    [[nodiscard]] Array columns(const std::string& folder) const {
        constexpr ColumnFlags kFaults{ColumnFlag::saturated,    ColumnFlag::clipped,   ColumnFlag::stuck,
                                      ColumnFlag::no_reference, ColumnFlag::dc_offset, ColumnFlag::overrun};
        const auto& c = file_.calibration;
        const auto phases = Correction::phases(c);
        const auto ideal = Correction::ideal_triads(c);
        LongCall call;
        std::vector<ColumnRow> rows;
        const host::Recording recording(folder, [&] { call.check(); });  // checks the files
        host::RecordLines lines(folder, host::RecordFile::inputs);
        for (std::string line; lines.next(line); call.check()) {
            const host::TrackerInput input = host::parse_input(line, lines.where());
            if (!has_couplings(input)) {
                continue;
            }
            Column<double> column = input.column;
            const int j = coil_index(column.state);
            ColumnRow row{static_cast<double>(column.midpoint.since_start().count()),
                          double(j),
                          0,
                          0,
                          0,
                          column.in_phase,
                          column.quadrature,
                          column.in_phase,
                          column.quadrature,
                          column.in_phase,
                          column.quadrature};
            row.faulty = column.flags.has_any(kFaults) ? 1 : 0;
            row.low = column.flags.has(ColumnFlag::low_band) ? 1 : 0;
            if (row.low > 0) {
                c.low_band.pick_up.remove(j, row.corrected_in_phase, row.corrected_quadrature);
            } else {
                Vec3<double> sigma = column.sigma;
                phases.correct_column(j, row.corrected_in_phase, row.corrected_quadrature, sigma);
                (ideal.ok() ? *ideal : phases).correct_column(j, row.tracked_in_phase, row.tracked_quadrature, column.sigma);
                row.variance = column.sigma.squaredNorm() / 3;
            }
            rows.push_back(row);
        }
        return Array({static_cast<py::ssize_t>(rows.size()), kColumnNumbers}, reinterpret_cast<const double*>(rows.data()));
    }

    /// Writes the calibration with these numbers: pick_up, low_pick_up (in phase, quadrature, deviation: 19), or ratio, phase_rad
    /// with floor, lag_s. json: result of the command, which is completed. Returns it.
    std::string write(const std::map<std::string, std::vector<double>>& found, const std::string& json,
                      const std::vector<std::string>& warnings) {
        auto& c = file_.calibration;
        auto& low = c.low_band;
        if (found.contains("ratio")) {
            low = {.pick_up = low.pick_up};
        }
        for (const auto& [name, p] : found) {
            if (name.ends_with("pick_up")) {
                const calibration::PickUp<double> pick_up{RowMajor3(p.data()), RowMajor3(p.data() + 9), p[18]};
                (name == "pick_up" ? c.pick_up : low.pick_up) = pick_up;
            } else if (name == "floor") {
                low.quadrature_floor = p[0];
            } else {
                (name == "ratio"       ? low.ratio
                 : name == "phase_rad" ? low.phase_rad
                                       : low.motion_lag_s) = Mat3<double>(RowMajor3(p.data()));
            }
        }
        host::CalibrationReport report{host::Json::parse(json), warnings};
        write_calibration(files_, file_, report);
        return host::json_line(report.json);
    }

private:
    host::CalibrationFiles files_;
    host::CalibrationFile file_;
};

}  // namespace

void add_bands(py::module_& module) {
    py::class_<Bands>(module, "Bands")
        .def(py::init<host::CalibrationFiles>())
        .def("coils", &Bands::coils)
        .def("columns", &Bands::columns)
        .def("write", &Bands::write);
    module.def("two_band_frame", [](const std::string& recording) {  // duration of a frame (s), frames of a window
        const double frame_s = host::two_band_frame_s(recording);
        return py::make_tuple(frame_s, tracking::dual_band_params(frame_s).window_frames);
    });
}

}  // namespace tricoil::python
