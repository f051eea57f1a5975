// Couplings of a sensor that a user places by hand: the mean over each rest of a recording.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "board/record/recording.hpp"
#include "board/support/coupling_text.hpp"

namespace tricoil::host {

/// Mean quadratures and levels of the couplings in a recording. Reads the columns of the first sensor, once.
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

/// A rest lasts 0.5 s or longer; meanwhile the signal matrix stays within 1 % of its mean (about 1 mm at 0.4 m). Its first and
/// last 0.1 s are left out of the mean.
class RestFinder {
public:
    using Put = std::function<void(std::string_view)>;

    /// Writes CSV lines: number, start and duration of the rest (s), nine couplings, their quadratures and levels, and the gain
    /// step. Writes the header at once. `folder`: of the recording. Throws like ColumnMeans.
    RestFinder(Put put, const std::string& folder);

    void add(DeviceTime time, const Mat3<double>& x);
    /// Returns the number of rests. Throws InputError, naming the folder, if there is none.
    int finish();
    /// The clock of the device started again.
    void restart();

private:
    struct Matrix {
        DeviceTime time;
        Mat3<double> x;
    };
    void end_rest();

    Put put_;
    std::string folder_;
    ColumnMeans means_;
    std::vector<Matrix> rest_;
    Mat3<double> sum_ = Mat3<double>::Zero();
    int rests_ = 0;
};

}  // namespace tricoil::host
