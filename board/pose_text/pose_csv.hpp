// Poses beside the truth as CSV, one line each, complete after every line; both in the frame, unit and angles asked for.
#pragma once

#include <cstdio>
#include <string>

#include "board/pose_text/output_format.hpp"

namespace tricoil::host {

/// Where the sensor really was.
struct TruePose {
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q_source_sensor = Quat<double>::Identity();
};

class PoseCsv {
public:
    /// Opens and writes the header. Throws InputError if the file cannot be made.
    explicit PoseCsv(const std::string& path, OutputFormat format = {});
    ~PoseCsv();
    PoseCsv(const PoseCsv&) = delete;
    PoseCsv& operator=(const PoseCsv&) = delete;

    void write(const tracking::PoseEstimate<double>& estimate, const TruePose& truth);

    /// Flushes to the disk. Throws DeviceError if anything could not be written.
    void close();

private:
    std::string path_;
    OutputFormat format_;
    std::FILE* file_ = nullptr;
    bool failed_ = false;
};

}  // namespace tricoil::host
