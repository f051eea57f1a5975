#include "board/host/serve/web/recording_library.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/web/request_head.hpp"
#include "board/page/pose_event.hpp"
#include "board/record/recorded_truth.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host::web {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPieceBytes = std::size_t{64} << 10U;
constexpr std::size_t kLongestDescriptionRead = std::size_t{1} << 20U;

bool is_complete(const fs::path& recording) {
    try {
        const auto description =
            nlohmann::json::parse(read_text((recording / kDescriptionFile).string(), kLongestDescriptionRead), nullptr, false);
        return description.is_object() && description.value("complete", nlohmann::json()) == true;
    } catch (const std::exception&) {
        return false;
    }
}

/// Appends the poses, at most kMostPlayedPoses; false if the client does not take them.
bool put_lines(const Recording& recording, std::string& text, const std::function<bool(std::size_t)>& pass) {
    const std::string parent = fs::path(recording.folder()).parent_path().string();
    RecordLines lines(recording.folder(), RecordFile::poses);
    RecordedTruth truth(recording, [&](const std::string& why) {
        text += json_line({{"error", without_folder(why, parent)}}) + "\n";
    });
    std::size_t count = 0;
    ExpectedError expected;
    for (std::string line; lines.next(line); ++count) {
        if (count == kMostPlayedPoses) {
            text += Json{{"error", fmt::format("only the first {} poses are sent", count)}}.dump() + "\n";
            return true;
        }
        const auto pose = parse_pose(line, lines.where());
        put_compact({pose, utc_time_us(to_us(pose.time)), expected.after(pose), truth.at(pose.sensor, pose.time)}, text);
        text += '\n';
        if (!pass(kPieceBytes)) {
            return false;
        }
    }
    return true;
}

}  // namespace

nlohmann::json RecordingLibrary::list() const {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (is_recording_name(name) && fs::is_regular_file(entry->path() / kDescriptionFile, error)) {
            names.push_back(name);
        }
        error.clear();
    }
    std::sort(names.rbegin(), names.rend());
    auto recordings = nlohmann::json::array();
    for (const std::string& name : names) {
        const fs::path path = fs::path(folder_) / name;
        const auto bytes = fs::file_size(path / kRecordFiles[static_cast<std::size_t>(RecordFile::poses)], error);
        recordings.push_back({{"name", name}, {"bytes", error ? 0 : bytes}, {"complete", is_complete(path)}});
    }
    return recordings;
}

Recording RecordingLibrary::open(const std::string& name, const std::function<void()>& each_block) const {
    std::error_code error;
    refuse_if(folder_.empty() || !is_recording_name(name) || !fs::is_directory(fs::path(folder_) / name, error),
              "there is no recording of this name in the folder of --record-folder");
    try {
        return Recording((fs::path(folder_) / name).string(), each_block);
    } catch (const std::exception& failure) {
        throw InputError(without_folder(failure.what(), folder_));
    }
}

void send_poses(const Recording& recording, const std::function<bool(std::string_view)>& put) {
    const fs::path path(recording.folder());
    std::string text = json_line({{"name", path.filename().string()},
                                  {"started", recording.description().value("started", nlohmann::json())},
                                  {"complete", recording.complete()}}) +
                       "\n";
    /// Passes the text on if there is enough of it. False if the client does not take it.
    const auto pass = [&](std::size_t enough) { return text.size() < enough || put(std::exchange(text, {})); };
    try {
        if (!put_lines(recording, text, pass)) {
            return;
        }
    } catch (const std::exception& failure) {
        text += json_line({{"error", without_folder(failure.what(), path.parent_path().string())}}) + "\n";
    }
    pass(1);
}

Playback::Playback(const std::string& folder, const std::string& name, bool takes_chunks)
    : thread_([=, this](const std::stop_token& stop) { run(folder, name, takes_chunks, stop); }) {}

std::optional<std::string> Playback::next() {
    const std::lock_guard lock(mutex_);
    if (piece_.empty() && complete_) {
        return std::nullopt;
    }
    taken_.notify_one();
    return std::exchange(piece_, {});
}

void Playback::run(const std::string& folder, const std::string& name, bool takes_chunks, const std::stop_token& stop) {
    try {
        const Recording recording = RecordingLibrary(folder).open(name, [&] {
            if (stop.stop_requested()) {
                throw std::runtime_error("the client has left");
            }
        });
        put(head_of_pieces("application/x-ndjson", takes_chunks), stop);
        send_poses(recording, [&](std::string_view poses) { return put(as_piece(poses, takes_chunks), stop); });
        put(last_piece(takes_chunks), stop);
    } catch (const std::exception& error) {
        put(answer(422, error.what()), stop);
    }
    const std::lock_guard lock(mutex_);
    complete_ = true;
}

/// Waits until the piece before it has been taken. False if the client has left.
bool Playback::put(std::string piece, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    if (!taken_.wait(lock, stop, [this] { return piece_.empty(); })) {
        return false;
    }
    piece_ = std::move(piece);
    return true;
}

}  // namespace tricoil::host::web
