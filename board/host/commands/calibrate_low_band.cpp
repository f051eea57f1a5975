#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "board/host/calibration/band_ratio.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "core/calibration/coil_correction.hpp"
#include "core/linear/eigen.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

struct LowBandCommand {
    CalibrationFiles files;
};

/// What the recordings give.
struct Bands {
    BandRatio ratio;
    MotionLag lag;
};

/// Corrections of high columns: of the phases alone, for the ratio; as the tracker corrects them, for the lag.
struct Corrections {
    calibration::CoilCorrection<double> phases;
    calibration::CoilCorrection<double> tracker;
};

/// Columns of the high band at one time.
class HighFrame {
public:
    /// Corrects the column. True if it completes the frame.
    bool add(Column<double> column, const calibration::CoilCorrection<double>& correction) {
        const int j = coil_index(column.state);
        correction.correct_column(j, column.in_phase, column.quadrature, column.sigma);
        columns_ = column.midpoint == time_ ? columns_ + 1 : 1;
        variance_ = column.sigma.squaredNorm() / 3;
        time_ = column.midpoint;
        in_phase_.col(j) = column.in_phase;
        quadrature_.col(j) = column.quadrature;
        return columns_ == kSourceCoils;
    }
    [[nodiscard]] DeviceTime time() const { return time_; }
    [[nodiscard]] const Mat3<double>& in_phase() const { return in_phase_; }
    [[nodiscard]] const Mat3<double>& quadrature() const { return quadrature_; }
    /// Of a coupling's noise.
    [[nodiscard]] double variance() const { return variance_; }

private:
    DeviceTime time_{};
    int columns_ = 0;
    Mat3<double> in_phase_ = Mat3<double>::Zero();
    Mat3<double> quadrature_ = Mat3<double>::Zero();
    double variance_ = 0;
};

/// The low columns of a frame follow its high columns.
void add_recording(const std::string& folder, double frame_s, const Corrections& corrections, Bands& bands) {
    const calibration::PickUp<double>& low_pick_up = corrections.phases.low_band().pick_up;
    const Microseconds longest_step = microseconds_from_seconds(1.5 * frame_s);
    RecordLines lines(folder, RecordFile::inputs);
    std::array<Column<double>, kSourceCoils> high{};  // the newest of each source coil
    std::array<DeviceTime, kSourceCoils> last{};      // time of its low column
    HighFrame frame;
    DeviceTime last_frame{};
    bands.lag.restart();
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
            if (frame.add(column, corrections.tracker)) {
                if (frame.time() - last_frame > longest_step || frame.time() < last_frame) {
                    bands.lag.restart();
                }
                last_frame = frame.time();
                bands.lag.add(frame.in_phase(), frame.quadrature(), frame.variance(), frame_s);
            }
        } else if (high[j].midpoint == column.midpoint) {
            if (column.midpoint - last[j] > longest_step || column.midpoint < last[j]) {
                bands.ratio.restart(coil);
            }
            last[j] = column.midpoint;
            Column<double> corrected = high[j];
            corrections.phases.correct_column(coil, corrected.in_phase, corrected.quadrature, corrected.sigma);
            Column<double> low = column;
            low_pick_up.remove(coil, low.in_phase, low.quadrature);
            bands.ratio.add(coil, corrected.in_phase, low.in_phase, low.quadrature);
        }
    }
}

/// All recordings must have the frame rate of the first one.
Bands bands_of(const std::vector<std::string>& recordings, const calibration::Calibration<double>& coils) {
    const auto phases = calibration::CoilCorrection<double>::phases(coils);
    const auto ideal = calibration::CoilCorrection<double>::ideal_triads(coils);
    const Corrections corrections{phases, ideal.ok() ? *ideal : phases};
    std::optional<Bands> bands;
    double first_s = 0;
    for (const std::string& folder : recordings) {
        const Recording recording(folder);  // checks the files
        const double frame_s = two_band_frame_s(folder);
        if (!bands) {
            bands = Bands{BandRatio(tracking::dual_band_params(frame_s).window_frames), {}};
            first_s = frame_s;
        } else if (std::abs(frame_s / first_s - 1) > 0.01) {
            throw InputError(folder + ": has another frame rate than " + recordings.front() + "; calibrate from one rate");
        }
        for (int j = 0; j < kSourceCoils; ++j) {
            bands->ratio.restart(j);
        }
        add_recording(folder, frame_s, corrections, *bands);
    }
    return *bands;
}

void refuse_undetermined(const Mat3<double>& sigma) {
    constexpr double kLargestSigma = 1e-3;  // 0.3 mm at 0.75 m
    Index i = 0;
    Index j = 0;
    const double worst = eigen(sigma).maxCoeff(&i, &j);
    refuse_if(!(worst <= kLargestSigma),
              "the ratio of the bands is not determined for sensor coil {} and source coil {} (standard deviation {:.2g}); "
              "record longer, nearer to the source, and turn the sensor about all its axes",
              i + 1, j + 1, worst);
}

CalibrationFile calibrate_low_band(const LowBandCommand& command, CalibrationReport& report) {
    Json& result = report.json;
    CalibrationFile file = read_calibration(command.files.calibration);
    const auto [bands, lag] = bands_of(command.files.data, file.calibration);
    const Mat3<double> sigma = bands.sigma();
    refuse_undetermined(sigma);
    auto& low_band = file.calibration.low_band;
    low_band = {.pick_up = low_band.pick_up};
    low_band.ratio = bands.ratio();
    if (bands.knows_phases()) {
        low_band.phase_rad = bands.phase_rad();
        low_band.quadrature_floor = std::min(bands.phase_sigma_rad().maxCoeff(), 1.0);
        result["low_band_phase_rad"] = rows_of(low_band.phase_rad);
    }
    if (lag.is_known()) {
        low_band.motion_lag_s = lag.lag_s();
        result["motion_lag_s"] = rows_of(low_band.motion_lag_s);
        result["motion_lag_sigma_s"] = lag.sigma_s().maxCoeff();
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
                : "phases of the low band: unknown; let the sensor rest for some seconds in several attitudes\n") +
           (result.contains("motion_lag_s")
                ? fill(result, "quadrature by motion, standard deviation {motion_lag_sigma_s:.2g} s\n")
                : "quadrature by motion: unknown; move and turn the sensor faster, near the source\n");
}

}  // namespace

void add_low_band_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<LowBandCommand>();
    CLI::App* const kind = add_kind(
        calibrate, "low-band", "Ratio of the low to the high band of each coupling, and phases of the low band", c->files,
        "Recordings in two bands, without metal, with the sensor turned about all its axes, and at rest for the phases");
    add_coils(kind, c->files);
    add_out(kind, c->files);
    set_examples(kind, {{"a recording in two bands, without metal", "tricoil run --mux dual-band --record turned"},
                        {"the ratio of both bands, from that recording",
                         "tricoil calibrate low-band --calibration cal.toml --out both.toml turned"}});
    set_fit(kind, action, c, calibrate_low_band, low_band_text);
}

}  // namespace tricoil::host
