// Poses beside the truth as CSV, one line each; both in the frame, unit and angles asked for.
#pragma once

#include <string>

#include "board/pose_text/output_format.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::host {

/// Where the sensor really was.
struct TruePose {
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q_source_sensor = Quat<double>::Identity();
};

class PoseCsv {
public:
    /// Opens and writes the header; throws as an OutputFile does.
    explicit PoseCsv(const std::string& path, OutputFormat format = {});

    void write(const tracking::PoseEstimate<double>& estimate, const TruePose& truth);

    /// Without it there is no file. Throws as OutputFile::commit() does.
    void commit() { file_.commit(); }

private:
    OutputFile file_;
    OutputFormat format_;
};

}  // namespace tricoil::host
