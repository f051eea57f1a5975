// Poses beside the truth as CSV, one line each, complete after every line; both in the frame, unit and angles asked for.
#pragma once

#include <cstdio>
#include <string>

#include "board/host/run/output_format.hpp"
#include "board/host/run/run_score.hpp"

namespace tricoil::host {

class PoseCsv {
public:
    /// Opens and writes the header. Throws InputError if the file cannot be made.
    explicit PoseCsv(const std::string& path, OutputFormat format = {});
    ~PoseCsv();
    PoseCsv(const PoseCsv&) = delete;
    PoseCsv& operator=(const PoseCsv&) = delete;

    void write(const tracking::PoseEstimate<double>& estimate, const PoseError& error);

    /// Flushes to the disk. Throws DeviceError if anything could not be written.
    void close();

private:
    std::string path_;
    OutputFormat format_;
    std::FILE* file_ = nullptr;
    bool failed_ = false;
};

}  // namespace tricoil::host
