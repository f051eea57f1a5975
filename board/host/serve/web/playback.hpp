// Answer with the poses of a recording.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace tricoil::host::web {

/// Checks and reads the recording in a thread of its own, because both can take seconds.
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
