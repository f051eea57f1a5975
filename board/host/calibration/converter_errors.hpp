// Errors of a board's converters and gain steps: correction of couplings, and fit to couplings at known poses.
#pragma once

#include <cstddef>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

/// How many couplings have known levels at the converters.
struct LevelCount {
    std::size_t known = 0;
    std::size_t unknown = 0;  // in files with levels
    std::size_t absent = 0;   // in files without levels

    void add(const CouplingFrame& couplings);
    LevelCount& operator+=(const LevelCount& other);
};

/// Throws InputError if there are errors to correct and only a part of the couplings has known levels: then the gain changed
/// during a rest, or the data are of two kinds.
void refuse_mixed_levels(const LevelCount& count, const signal::ConverterErrors& errors);

/// Corrects the couplings as a board does that stores these errors. Couplings without known levels are taken as corrected.
void correct_converters(CouplingFrame& couplings, const signal::ConverterErrors& errors);

/// The same for each row of for_each_row().
template <typename Rows>
void correct_converters(Rows& rows, const signal::ConverterErrors& errors) {
    for_each_row(rows, [&](CouplingFrame& row) { correct_converters(row, errors); });
}

/// Removes stored errors of the board's converters, the pick-up and the phases of the coils. Returns the numbers of rows with and
/// without levels. Throws InputError like refuse_mixed_levels().
template <typename Rows>
LevelCount correct_board(Rows& rows, const calibration::Calibration<double>& stored) {
    LevelCount count;
    for_each_row(rows, [&](const CouplingFrame& row) { count.add(row); });
    refuse_mixed_levels(count, stored.converters);
    correct_converters(rows, stored.converters);
    remove_phases_of(rows, stored);
    return count;
}

struct ConverterFit {
    CalibrationFit coils;  // of the corrected couplings
    signal::ConverterErrors errors;
    double non_linearity_lsb = 0;  // RMS of the removed amplitude errors over all couplings, without gain, 1/2048 of full scale
    double gain_error = 0;         // RMS of the removed errors of the gain steps in use, relative
};

/// Fits coils and converters in turn, and corrects the couplings of `files`. Least squares: the part of a coupling that the coils
/// do not explain is an error of its gain step, or a non-linearity of its converter at the amplitude of the coupling
/// (signal::ConverterErrors). Jumps are expected to be small, and smaller where only lower bits change. Outliers are not used.
/// Throws InputError like fit_calibration, for a pose without levels (FILE:LINE), for fewer than kFewestConverterPoses, and for
/// errors that sound converters do not have.
ConverterFit fit_converters(std::vector<PoseFile>& files, FitOptions options);

/// Nine couplings each; the errors are some seventy numbers.
constexpr std::size_t kFewestConverterPoses = 36;

}  // namespace tricoil::host
