#include "board/pose_source/recorded_source.hpp"

namespace tricoil::host {

bool RecordedSource::do_advance(Microseconds /*patience*/) {
    if (!queue().empty()) {
        return true;
    }
    ended_ = !player_.read();
    if (!ended_) {
        player_.play();
    }
    return !ended_;
}

std::string RecordedSource::do_status() const { return ended_ ? "the recording has ended" : "reading a recording"; }

}  // namespace tricoil::host
