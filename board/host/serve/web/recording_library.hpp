// Recordings that the live page lists and plays.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

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

/// Answer with the poses of a recording. Checks and reads the recording in a thread of its own, because both can take seconds.
class Playback {
public:
    /// folder: of RecordingLibrary.
    Playback(const std::string& folder, const std::string& name, bool takes_chunks);

    /// Next piece of the answer; empty: not yet; nullopt: the answer is complete.
    std::optional<std::string> next();

private:
    void run(const std::string& folder, const std::string& name, bool takes_chunks, const std::stop_token& stop);
    bool put(std::string piece, const std::stop_token& stop);

    std::mutex mutex_;
    std::condition_variable_any taken_;
    std::string piece_;
    bool complete_ = false;
    std::jthread thread_;  // ends first
};

}  // namespace tricoil::host::web
