#include "board/record/recorded_truth.hpp"

#include <fmt/format.h>

#include <utility>

#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {

RecordedTruth::RecordedTruth(const Recording& recording, std::function<void(const std::string&)> say)
    : recording_(recording), say_(std::move(say)) {
    const nlohmann::json::json_pointer frame("/source/truth_frame");
    const auto& known = recording.description();
    is_in_source_frame_ = known.contains(frame) && known.at(frame) == "source";
    try {
        lines_.emplace(recording.folder(), RecordFile::events);
    } catch (const InputError& error) {
        end(error.what());
    }
}

std::optional<solver::RigidPose<double>> RecordedTruth::at(std::uint8_t sensor, DeviceTime time) {
    read_until(time);
    if (!cut_.empty() && time > *newest_) {
        end(std::exchange(cut_, {}));
    }
    auto& next = next_.at(sensor);
    while (!next.empty() && next.front().time < time) {
        next.pop_front();
    }
    return !next.empty() && next.front().time == time ? std::optional(next.front().pose) : std::nullopt;
}

void RecordedTruth::read_until(DeviceTime time) {
    while (lines_ && (!newest_ || *newest_ <= time + kDisorder)) {
        const auto truth = read();
        if (!truth) {
            lines_.reset();
            return;
        }
        newest_ = truth->time;
        next_.at(truth->sensor).push_back(*truth);
    }
}

std::optional<TrueSensor> RecordedTruth::read() {
    try {
        for (std::string line; lines_->next(line);) {
            const auto truth = parse_truth(line, lines_->where());
            if (truth) {
                refuse_if(!is_in_source_frame_, "{}: true poses of another frame than the source's", lines_->where());
                return truth;
            }
        }
        if (newest_ && !recording_.complete()) {
            cut_ = fmt::format("{}: the recording was cut at {:.3f} s", lines_->where(), to_seconds(newest_->since_start()));
        }
    } catch (const InputError& error) {
        end(error.what());
    }
    return std::nullopt;
}

void RecordedTruth::end(const std::string& why) {
    const std::string line = why + "; later poses are without their true pose";
    say_ ? say_(line) : print_notice("tricoil: {}\n", line);
}

}  // namespace tricoil::host
