#include "board/host/commands/evaluate_dynamic.hpp"

#include <fmt/format.h>

#include <cmath>

#include "board/host/dynamic/dynamic_report.hpp"
#include "board/host/figures/gnuplot.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kCsv = "dynamic_errors.csv";

Picture picture() {
    const std::string dots = "points pt 7 ps 0.25 lc rgb '#cc0000'";
    Picture picture;
    picture.file = "dynamic_errors.svg";
    picture.panels = {{"Position error against speed",
                       "Speed (m/s)",
                       "Error (mm)",
                       {{kCsv, "speed_m_s", "(column('position_error_mm'))", "", dots}},
                       ""},
                      {"Position error against acceleration",
                       "Acceleration (m/s^2)",
                       "Error (mm)",
                       {{kCsv, "acceleration_m_s2", "(column('position_error_mm'))", "", dots}},
                       ""},
                      {"Orientation error against speed",
                       "Speed (m/s)",
                       "Error (deg)",
                       {{kCsv, "speed_m_s", "(column('orientation_error_deg'))", "", dots}},
                       ""}};
    return picture;
}

}  // namespace

int evaluate_dynamic(const DynamicOptions& options) {
    if (options.time_offset_s && !(std::abs(*options.time_offset_s) < 1e6)) {
        throw InputError("--time-offset must be a number of seconds");
    }
    const auto reference = PoseStream::read(options.files.at(0));
    const auto tracker = PoseStream::read(options.files.at(1));
    const auto report = dynamic_report(tracker, reference, align_streams(tracker, reference, options.time_offset_s));
    if (!options.out.empty()) {
        const InterruptGuard guard;
        StagedFolder folder(options.out);
        write_whole_file(folder.path() / kCsv, dynamic_csv(report));
        draw(folder.path(), {picture()}, guard);
        folder.publish();
    }
    print_result(dynamic_result(report), options.json, dynamic_text);
    return to_int(ExitCode::fine);
}

}  // namespace tricoil::host
