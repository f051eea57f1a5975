// CSV file with pose and true pose per line, both in the selected coordinate frame, unit and Euler angles.
#pragma once

#include <string>

#include "board/pose_text/output_format.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::host {

class PoseCsv {
public:
    /// Opens the file and writes the header. Throws like OutputFile.
    explicit PoseCsv(const std::string& path, OutputFormat format = {});

    void write(const tracking::PoseEstimate<double>& estimate, const TruePose& truth);

    /// Moves the file into place; without commit() no file remains. Throws like OutputFile::commit().
    void commit() { file_.commit(); }

private:
    OutputFile file_;
    OutputFormat format_;
};

}  // namespace tricoil::host
