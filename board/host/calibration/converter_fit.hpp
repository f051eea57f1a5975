// Errors of the board's converters and gain steps from couplings at known poses.
#pragma once

#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

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
