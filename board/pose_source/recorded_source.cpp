#include "board/pose_source/recorded_source.hpp"

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

std::optional<InputReplay> make_replay(const Recording& recording, const std::string& tracker) {
    if (recording.settings()) {
        return InputReplay(tracker.empty() ? *recording.settings() : with_tracker(recording, tracker));
    }
    if (!tracker.empty()) {
        throw InputError(recording.folder() + ": has no columns to track: the device computed the poses; leave the tracker out");
    }
    return std::nullopt;
}

}  // namespace

RecordedSource::RecordedSource(const std::string& folder, const std::string& tracker)
    : recording_(folder),
      replay_(make_replay(recording_, tracker)),
      lines_(folder, replay_ ? RecordFile::inputs : RecordFile::poses) {}

bool RecordedSource::do_advance(Microseconds /*patience*/) {
    if (!queue().empty()) {
        return true;
    }
    std::string line;
    if (!lines_.next(line)) {
        ended_ = true;
        return false;
    }
    if (!replay_) {
        queue().pose(parse_pose(line, lines_.where()));
    } else if (const auto pose = replay_->take(parse_input(line, lines_.where()), lines_.where())) {
        queue().pose(*pose);
    }
    return true;
}

std::string RecordedSource::do_status() const { return ended_ ? "the recording has ended" : "reading a recording"; }

}  // namespace tricoil::host
