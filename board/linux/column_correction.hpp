// Correction of a device's columns for the errors of its converters, if the device has not corrected them.
#pragma once

#include "core/signal/column.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::linux_board {

/// The column as a board sends it that stores these errors. Only couplings with a known level change (TDM, a board that stores no
/// such errors); their levels are then unknown.
inline MeasuredColumn<double> corrected(MeasuredColumn<double> column, const signal::ConverterErrors& errors) {
    if (errors == signal::ConverterErrors{} || column.gain_step >= signal::kMaxGainSteps) {
        return column;
    }
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        if (column.level[coil] == 0) {
            continue;
        }
        const float amplitude = static_cast<float>(column.level[coil]) / kLevelsPerFullScale;
        const auto factor = static_cast<double>(errors.correction(column.gain_step, coil, amplitude, true));
        const auto i = static_cast<Index>(coil);
        column.in_phase(i) *= factor;
        column.quadrature(i) *= factor;
        column.level[coil] = 0;
    }
    return column;
}

}  // namespace tricoil::linux_board
