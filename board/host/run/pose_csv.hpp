// Poses beside the truth as CSV, one line each; both in the frame, unit and angles asked for.
#pragma once

#include <string>

#include "board/host/output_file.hpp"
#include "board/host/run/output_format.hpp"
#include "board/host/run/run_score.hpp"

namespace tricoil::host {

class PoseCsv {
public:
    /// Opens and writes the header; throws as an OutputFile does.
    explicit PoseCsv(const std::string& path, OutputFormat format = {});

    void write(const tracking::PoseEstimate<double>& estimate, const PoseError& error);

    /// Without it there is no file. Throws as OutputFile::commit() does.
    void commit() { file_.commit(); }

private:
    OutputFile file_;
    OutputFormat format_;
};

}  // namespace tricoil::host
