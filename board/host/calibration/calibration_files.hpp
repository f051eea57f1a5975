// Files and report of a calibration.
#pragma once

#include <string>
#include <vector>

#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

/// Files of one calibration; an empty name: none.
struct CalibrationFiles {
    std::vector<std::string> data;
    std::string calibration;      // of the coils, for the kinds that add to it
    std::string converters_from;  // calibration whose errors of the board's converters are kept
    std::string out;
    std::string blob;
    std::string wiring;  // of the channels of the data
};

struct CalibrationReport {
    Json json;
    std::vector<std::string> warnings;
};

/// Throws InputError if an output replaces an input or the other output.
void check_files(const CalibrationFiles& files);

/// Calibration with the errors of the converters and the pick-up in --converters-from; ideal without it. Throws InputError if the
/// file has none.
calibration::Calibration<double> stored_board(const CalibrationFiles& files);

/// Writes the files of a calibration when all are complete, and completes its report.
void write_calibration(const CalibrationFiles& files, const CalibrationFile& file, CalibrationReport& report);

}  // namespace tricoil::host
