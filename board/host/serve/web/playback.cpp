#include "board/host/serve/web/playback.hpp"

#include <stdexcept>
#include <utility>

#include "board/host/serve/web/recording_library.hpp"
#include "board/host/serve/web/request_head.hpp"

namespace tricoil::host::web {

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
