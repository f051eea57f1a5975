// Mean quadratures and levels of the couplings in a recording.
#pragma once

#include <string>

#include "board/record/record_lines.hpp"
#include "board/record/recording.hpp"
#include "board/support/coupling_text.hpp"

namespace tricoil::host {

/// Reads the columns of the first sensor, once.
class ColumnMeans {
public:
    struct Means {
        Mat3<double> quadrature;  // NaN for a source coil without columns
        SignalLevels levels;      // unknown if the gain step changed
    };

    /// Throws like RecordLines.
    explicit ColumnMeans(const std::string& folder) : lines_(folder, RecordFile::inputs) {}

    /// Over the columns between two times, without those of a fault. Each call begins after the times of the call before. Throws
    /// InputError for a damaged line.
    Means between(DeviceTime from, DeviceTime to);

    /// Skips the columns up to the next one that is older than the one before: the device's clock started again.
    void skip_to_restart();

private:
    bool advance();

    RecordLines lines_;
    TrackerInput next_;
    bool has_next_ = false;
};

}  // namespace tricoil::host
