#include "board/host/commands/calibrate_low_band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "board/host/calibration/band_ratio.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_rows.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

/// Time between frames. Throws InputError if the recording has no columns of two bands.
double frame_of(const std::string& folder) {
    RecordLines lines(folder, RecordFile::inputs);
    std::optional<Column<double>> first;
    for (std::string line; lines.next(line);) {
        const TrackerInput input = parse_input(line, lines.where());
        if (!has_couplings(input) || !input.column.flags.has(ColumnFlag::low_band)) {
            continue;
        }
        if (first && first->state == input.column.state && input.column.midpoint > first->midpoint) {
            return to_seconds(input.column.midpoint - first->midpoint);
        }
        first = first ? first : std::optional(input.column);
    }
    throw InputError(folder + ": has no columns of two bands; record with --mux dual-band, or with a device in this mode");
}

/// The low columns of a frame follow its high columns. phases: of the high band.
void add_recording(const std::string& folder, double frame_s, const calibration::CoilCorrection<double>& phases,
                   BandRatio& bands) {
    const Microseconds longest_step = microseconds_from_seconds(1.5 * frame_s);
    RecordLines lines(folder, RecordFile::inputs);
    std::array<Column<double>, kSourceCoils> high{};  // the newest of each source coil
    std::array<DeviceTime, kSourceCoils> last{};      // time of its low column
    for (std::string line; lines.next(line);) {
        const TrackerInput input = parse_input(line, lines.where());
        if (!has_couplings(input)) {
            continue;
        }
        const Column<double>& column = input.column;
        const int coil = coil_index(column.state);
        const auto j = static_cast<std::size_t>(coil);
        if (!column.flags.has(ColumnFlag::low_band)) {
            high[j] = column;
        } else if (high[j].midpoint == column.midpoint) {
            if (column.midpoint - last[j] > longest_step || column.midpoint < last[j]) {
                bands.restart(coil);
            }
            last[j] = column.midpoint;
            Column<double> corrected = high[j];
            phases.correct_column(coil, corrected.in_phase, corrected.quadrature, corrected.sigma);
            bands.add(coil, corrected.in_phase, column.in_phase, column.quadrature);
        }
    }
}

BandRatio ratio_for(const std::string& folder, double frame_s) {
    const int window = tracking::dual_band_params(frame_s).window_frames;
    if (window == 0) {
        throw InputError(folder + ": 0.1 to 0.2 s hold no whole number of its frames; record at another frame rate");
    }
    return BandRatio(window);
}

/// All recordings must have the frame rate of the first one.
BandRatio ratio_of(const std::vector<std::string>& recordings, const calibration::Calibration<double>& coils) {
    const auto phases = calibration::CoilCorrection<double>::phases(coils);
    std::optional<BandRatio> bands;
    double first_s = 0;
    for (const std::string& folder : recordings) {
        const Recording recording(folder);  // checks the files
        const double frame_s = frame_of(folder);
        if (!bands) {
            bands = ratio_for(folder, frame_s);
            first_s = frame_s;
        } else if (std::abs(frame_s / first_s - 1) > 0.01) {
            throw InputError(folder + ": has another frame rate than " + recordings.front() + "; calibrate from one rate");
        }
        for (int j = 0; j < kSourceCoils; ++j) {
            bands->restart(j);
        }
        add_recording(folder, frame_s, phases, *bands);
    }
    return *bands;
}

void refuse_undetermined(const Mat3<double>& sigma) {
    constexpr double kLargestSigma = 1e-3;  // 0.3 mm at 0.75 m
    Eigen::Index i = 0;
    Eigen::Index j = 0;
    const double worst = sigma.maxCoeff(&i, &j);
    if (!(worst <= kLargestSigma)) {
        throw InputError(fmt::format(
            "the ratio of the bands is not determined for sensor coil {} and source coil {} (standard deviation {:.2g}); record "
            "longer, nearer to the source, and turn the sensor about all its axes",
            i + 1, j + 1, worst));
    }
}

}  // namespace

CalibrationFile calibrate_low_band(const std::string& calibration, const std::vector<std::string>& recordings, Json& result) {
    CalibrationFile file = read_calibration(calibration);
    const BandRatio bands = ratio_of(recordings, file.calibration);
    const Mat3<double> sigma = bands.sigma();
    refuse_undetermined(sigma);
    auto& low_band = file.calibration.low_band;
    low_band = {};
    low_band.ratio = bands.ratio();
    if (bands.knows_phases()) {
        low_band.phase_rad = bands.phase_rad();
        low_band.quadrature_floor = std::min(bands.phase_sigma_rad().maxCoeff(), 1.0);
        result["low_band_phase_rad"] = rows_of(low_band.phase_rad);
    }
    result["low_band_quadrature_floor"] = low_band.quadrature_floor;
    result["columns"] = bands.columns();
    result["low_band_ratio"] = rows_of(bands.ratio());
    result["least_ratio"] = bands.ratio().minCoeff();
    result["most_ratio"] = bands.ratio().maxCoeff();
    result["ratio_sigma"] = sigma.maxCoeff();
    return file;
}

std::string low_band_text(const Json& result) {
    return fill(result,
                "{columns} columns; couplings of the low band relative to the high band: {least_ratio:.5f} to {most_ratio:.5f}, "
                "standard deviation {ratio_sigma:.2g}\n") +
           (result.contains("low_band_phase_rad")
                ? fill(result, "phases of the low band, standard deviation {low_band_quadrature_floor:.2g} rad\n")
                : "phases of the low band: unknown; let the sensor rest for some seconds in several attitudes\n");
}

}  // namespace tricoil::host
