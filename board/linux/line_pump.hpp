// Writes lines to a file or pipe in a separate thread, so that a slow reader never delays the loop that switches the coils.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::linux_board {

class LinePump {
public:
    /// Creates a file. Throws InputError on failure.
    explicit LinePump(const std::string& path);
    /// Writes to an open descriptor that the caller owns. `name`: for messages.
    LinePump(int descriptor, std::string name);
    ~LinePump();

    /// Queues a line. Never waits, no heap. A line that does not fit is dropped and counted.
    void push(std::string_view line);

    /// True if the reader has closed the pipe.
    [[nodiscard]] bool is_unread() const;
    /// True if nothing more can be written: the reader has closed the pipe, or the disk is full.
    [[nodiscard]] bool has_failed() const;

    struct Depth {
        std::size_t queued_bytes = 0;
        std::uint64_t dropped = 0;  // lines
    };
    [[nodiscard]] Depth depth() const;
    /// True if many lines wait, although most of the room is free.
    [[nodiscard]] bool is_behind() const { return depth().queued_bytes > kCapacity / 8; }

    /// Writes the queued lines, for at most two seconds. Returns one line with the lost lines and the reason; empty if none.
    std::string close();

    /// For text after the last line: waits until the reader takes a page of it, for at most two seconds. Returns false if it does
    /// not.
    [[nodiscard]] bool takes_more() const;

private:
    static constexpr std::size_t kCapacity = std::size_t{1} << 20U;  // several seconds of poses

    void run();
    bool write_some(std::string_view bytes, std::size_t& written);

    drivers::FileDescriptor owned_;
    int descriptor_;
    std::string name_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<char> ring_;  // allocated once
    std::size_t begin_ = 0;
    std::size_t size_ = 0;
    std::uint64_t dropped_ = 0;  // lines
    int error_ = 0;              // errno of the write that failed
    bool closing_ = false;
    std::chrono::steady_clock::time_point deadline_;
    std::thread thread_;
};

}  // namespace tricoil::linux_board
