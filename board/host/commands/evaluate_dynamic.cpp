#include "board/host/commands/evaluate_dynamic.hpp"

#include <cmath>

#include "board/host/dynamic/dynamic_report.hpp"
#include "board/host/figures/draw.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {

int evaluate_dynamic(const DynamicOptions& options) {
    refuse_if(options.time_offset_s && !(std::abs(*options.time_offset_s) < 1e6), "--time-offset must be a number of seconds");
    const auto reference = PoseStream::read(options.files.at(0));
    const auto tracker = PoseStream::read(options.files.at(1));
    const auto report = dynamic_report(tracker, reference, align_streams(tracker, reference, options.time_offset_s));
    if (!options.out.empty()) {
        const InterruptGuard guard;
        StagedFolder folder(options.out);
        write_whole_file(folder.path() / "dynamic_errors.csv", dynamic_csv(report));
        draw_and_publish(folder, options.out, {"dynamic_errors.svg"}, guard);
    }
    print_result(dynamic_result(report), options.json, dynamic_text);
    return to_int(ExitCode::fine);
}

}  // namespace tricoil::host
