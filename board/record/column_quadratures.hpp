// Mean quadratures of the couplings in a recording.
#pragma once

#include <string>

#include "board/record/record_lines.hpp"
#include "board/record/recording.hpp"

namespace tricoil::host {

/// Reads the columns of the first sensor, once.
class ColumnQuadratures {
public:
    /// Throws like RecordLines.
    explicit ColumnQuadratures(const std::string& folder) : lines_(folder, RecordFile::inputs) {}

    /// Mean over the columns between two times, without those of a fault; NaN for a source coil without columns. Each call begins
    /// after the times of the call before. Throws InputError for a damaged line.
    Mat3<double> mean(DeviceTime from, DeviceTime to);

    /// Skips the columns up to the next one that is older than the one before: the device's clock started again.
    void skip_to_restart();

private:
    bool advance();

    RecordLines lines_;
    TrackerInput next_;
    bool has_next_ = false;
};

}  // namespace tricoil::host
