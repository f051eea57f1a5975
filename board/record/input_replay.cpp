#include "board/record/input_replay.hpp"

#include <fmt/format.h>

#include "board/record/two_band_frame.hpp"
#include "board/support/errors.hpp"
#include "board/support/tracker_choice.hpp"

namespace tricoil::host {

TrackerSettings with_tracker(const Recording& recording, const std::string& tracker) {
    TrackerSettings settings = *recording.settings();
    const tracking::MethodParams<double> method = method_of_name(tracker);
    if (tracker == name_of_method(settings.tracker.method)) {
        return settings;
    }
    settings.tracker.method = method;
    if (std::holds_alternative<tracking::DualBandParams>(method)) {
        settings.tracker.method = tracking::dual_band_params(two_band_frame_s(recording.folder()));
    }
    deskew_in_turn(settings.tracker);
    const Status status = tracking::AnyTracker<double>::check(settings.tracker, settings.calibration);
    if (!status.ok()) {
        throw InputError(fmt::format("{}: --tracker {}: {}", recording.folder(), tracker, status.message()));
    }
    return settings;
}

InputReplay::InputReplay(const TrackerSettings& settings) : settings_(settings) { make_trackers(); }

std::optional<tracking::PoseEstimate<double>> InputReplay::take(const TrackerInput& input, const std::string& where) {
    if (input.kind == InputKind::begin) {
        make_trackers();
        return std::nullopt;
    }
    if (input.sensor >= trackers_.size()) {
        throw InputError(
            fmt::format("{}: sensor {} does not exist; the recording has {}", where, input.sensor, trackers_.size()));
    }
    tracking::AnyTracker<double>& tracker = *trackers_[input.sensor];
    switch (input.kind) {
        case InputKind::column:
            return tracker.update(input.column);
        case InputKind::tick:
            return tracker.tick(input.now);
        default:
            (void)tracker.set_hemisphere(input.hemisphere);  // a refused hemisphere is refused again
            return std::nullopt;
    }
}

void InputReplay::make_trackers() {
    trackers_.clear();
    for (int n = 0; n < settings_.sensors; ++n) {
        trackers_.push_back(std::make_unique<tracking::AnyTracker<double>>(settings_.tracker, settings_.calibration));
    }
}

}  // namespace tricoil::host
