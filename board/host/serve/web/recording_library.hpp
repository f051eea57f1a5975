// Recordings that the live page lists and plays.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "board/record/recording.hpp"

namespace tricoil::host::web {

constexpr std::size_t kMostPlayedPoses = 500'000;  // further poses of a recording are not sent

class RecordingLibrary {
public:
    /// folder: parent of the recordings; empty: none.
    explicit RecordingLibrary(std::string folder) : folder_(std::move(folder)) {}

    /// [{"name", "bytes" (of its poses), "complete"}], the newest name first. Folders that are not recordings are left out.
    [[nodiscard]] nlohmann::json list() const;

    /// Throws InputError, without the folder's path, if there is no such recording, or it was changed. each_block: of Recording.
    [[nodiscard]] Recording open(const std::string& name, const std::function<void()>& each_block = {}) const;

private:
    std::string folder_;
};

/// Sends a recording as lines, in pieces: first {"name", "started", "complete"}, then poses in compact form. If the recording is
/// damaged further on, the last line is {"error": text}. Ends early if `put` returns false.
void send_poses(const Recording& recording, const std::function<bool(std::string_view)>& put);

}  // namespace tricoil::host::web
