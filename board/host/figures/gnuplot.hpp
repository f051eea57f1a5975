// Draws pictures with gnuplot.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "board/support/interrupt.hpp"
#include "board/support/progress.hpp"

namespace tricoil::host {

/// One curve of a CSV file with header.
struct Curve {
    std::string file;
    std::string x;  // column names; y may be a gnuplot expression
    std::string y;
    std::string title;  // empty: not in the legend
    std::string style;  // gnuplot style, e.g. "lines lc rgb 'red'"
};

struct Panel {
    std::string title;
    std::string x_label;
    std::string y_label;
    std::vector<Curve> curves;
    std::string settings;  // more gnuplot lines for this panel
};

struct Picture {
    std::string file;  // .svg or .png
    std::vector<Panel> panels;
    int columns = 1;
    int panel_width = 640;
    int panel_height = 260;
};

/// Line styles of the paper.
constexpr const char* kMeasuredStyle = "lines lw 1.2 lc rgb '#cc0000'";
constexpr const char* kCalculatedStyle = "lines lw 1.4 dt '_.' lc rgb 'black'";

/// Draws into `folder`, which contains the CSV files. Throws InputError if gnuplot is not installed or fails. After a signal it
/// stops gnuplot and throws Interrupted. progress: called while gnuplot draws; may be empty.
void draw(const std::filesystem::path& folder, const std::vector<Picture>& pictures, const InterruptGuard& guard,
          const ShowShare& progress = {});

}  // namespace tricoil::host
