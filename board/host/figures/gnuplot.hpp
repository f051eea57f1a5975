// Pictures, drawn by gnuplot.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "board/support/interrupt.hpp"

namespace tricoil::host {

/// One curve of a CSV file with a header line.
struct Curve {
    std::string file;
    std::string x;  // column names; y may be an expression, in gnuplot's words
    std::string y;
    std::string title;  // empty: not in the key
    std::string style;  // gnuplot's, e.g. "lines lc rgb 'red'"
};

struct Panel {
    std::string title;
    std::string x_label;
    std::string y_label;
    std::vector<Curve> curves;
    std::string settings;  // more gnuplot lines for this panel
};

struct Picture {
    std::string file;  // .svg
    std::vector<Panel> panels;
    int columns = 1;
    int panel_width = 640;
    int panel_height = 260;
};

/// The paper's line styles.
constexpr const char* kMeasuredStyle = "lines lw 1.2 lc rgb '#cc0000'";
constexpr const char* kCalculatedStyle = "lines lw 1.4 dt '_.' lc rgb 'black'";

/// Draws into `folder`, where the CSV files are too. Throws InputError if gnuplot is not installed or refuses, Interrupted, with
/// gnuplot stopped, if the guard sees a signal.
void draw(const std::filesystem::path& folder, const std::vector<Picture>& pictures, const InterruptGuard& guard);

}  // namespace tricoil::host
