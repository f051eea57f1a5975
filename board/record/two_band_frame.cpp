#include "board/record/two_band_frame.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

/// The first intervals between low columns of one source coil. Empty without columns of two bands.
std::vector<double> intervals_s(const std::string& recording) {
    constexpr std::size_t kIntervals = 50;
    RecordLines lines(recording, RecordFile::inputs);
    std::optional<Column<double>> last;
    std::vector<double> intervals;
    for (std::string line; intervals.size() < kIntervals && lines.next(line);) {
        const TrackerInput input = parse_input(line, lines.where());
        const Column<double>& column = input.column;
        if (!has_couplings(input) || !column.flags.has(ColumnFlag::low_band) || (last && last->state != column.state)) {
            continue;
        }
        if (last && column.midpoint > last->midpoint) {
            intervals.push_back(to_seconds(column.midpoint - last->midpoint));
        }
        last = column;
    }
    return intervals;
}

/// Mean without those over lost frames. The mean, because time stamps are whole microseconds.
double mean_of_complete(const std::vector<double>& intervals) {
    const double longest_s = 1.5 * *std::min_element(intervals.begin(), intervals.end());
    double sum_s = 0;
    int complete = 0;
    for (const double interval_s : intervals) {
        sum_s += interval_s <= longest_s ? interval_s : 0;
        complete += interval_s <= longest_s ? 1 : 0;
    }
    return sum_s / complete;
}

}  // namespace

double two_band_frame_s(const std::string& recording) {
    const std::vector<double> intervals = intervals_s(recording);
    if (intervals.empty()) {
        throw InputError(recording + ": has no columns of two bands; record with --mux dual-band, or with a device in this mode");
    }
    const double frame_s = mean_of_complete(intervals);
    if (tracking::dual_band_params(frame_s).window_frames == 0) {
        throw InputError(recording + ": 0.1 to 0.2 s hold no whole number of its frames; record at another frame rate");
    }
    return frame_s;
}

}  // namespace tricoil::host
