#include "board/host/calibration/calibration_files.hpp"

#include <cmath>

#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "core/calibration/blob.hpp"

namespace tricoil::host {
namespace {

/// Replaces older files only when both new ones are complete.
void write_files(const CalibrationFiles& files, const CalibrationFile& file) {
    const Status status = calibration::check(file.calibration);
    if (!status.ok()) {
        throw InputError(status.message());
    }
    OutputFile out(files.out);
    out.write(to_toml(file));
    if (!files.blob.empty()) {
        const auto bytes = calibration::encode(file.calibration);
        OutputFile blob(files.blob);
        blob.write(std::string(bytes.begin(), bytes.end()));
        out.flush();
        blob.commit();
    }
    out.commit();
}

/// A blob without errors of the converters ends the correction by a board that stores some. Such a board sends no levels; there
/// are none in FDM either.
void warn_of_lost_converters(const CalibrationFiles& files, const CalibrationFile& file, CalibrationReport& report) {
    if (!files.blob.empty() && file.calibration.converters == signal::ConverterErrors{} &&
        report.json.value("unknown_levels", 0) > 0) {
        report.warnings.push_back(files.blob +
                                  ": does not contain errors of converters; a board that stores some would no longer correct "
                                  "them: calibrate the coils with --converters-from CAL.toml to keep them");
    }
}

}  // namespace

void check_files(const CalibrationFiles& files) {
    refuse_if(files.data.empty(), "no files of couplings are given");
    std::vector<std::string> inputs = files.data;
    inputs.insert(inputs.end(), {files.calibration, files.converters_from, files.wiring});
    check_outputs({{"--out", files.out}, {"--blob", files.blob}}, inputs);
    refuse_if(!files.blob.empty() && !files.wiring.empty(),
              "--blob: not with --wiring: a board cannot apply a wiring file; exchange and reverse the coils instead");
}

calibration::Calibration<double> stored_board(const CalibrationFiles& files) {
    calibration::Calibration<double> stored;
    if (files.converters_from.empty()) {
        return stored;
    }
    const calibration::Calibration<double> known = read_calibration(files.converters_from).calibration;
    stored.converters = known.converters;
    stored.pick_up = known.pick_up;
    stored.low_band.pick_up = known.low_band.pick_up;
    refuse_if(stored.converters == signal::ConverterErrors{} && stored.pick_up.is_none(),
              "{}: does not contain errors of converters or pick-up; give the file that tricoil calibrate converters or pick-up "
              "made",
              files.converters_from);
    return stored;
}

void write_calibration(const CalibrationFiles& files, const CalibrationFile& file, CalibrationReport& report) {
    warn_of_lost_converters(files, file, report);
    write_files(files, file);
    if (const auto& pick_up = file.calibration.pick_up; !pick_up.is_none()) {
        const double strength = file.calibration.model.source_moment.norm() / std::sqrt(3.0) / std::pow(0.75, 3);
        report.json["pick_up"] = {{"share_rms", pick_up.in_phase.norm() / 3 / strength}, {"sigma", pick_up.sigma / strength}};
    }
    if (file.calibration.quadrature_floor < 1) {
        report.json["quadrature_floor"] = file.calibration.quadrature_floor;
    }
    report.json["warnings"] = report.warnings;
    report.json["out"] = files.out;
}

}  // namespace tricoil::host
