// Lines to a file or a pipe by a thread of its own: whoever reads slowly, or not at all, never holds up the loop that has coils
// to switch.
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
    /// To a file that it makes; throws InputError if it cannot be made.
    explicit LinePump(const std::string& path);
    /// To what is open already and stays its owner's; `name` stands for it in messages.
    LinePump(int descriptor, std::string name);
    ~LinePump();
    LinePump(const LinePump&) = delete;
    LinePump& operator=(const LinePump&) = delete;

    /// Whole or not at all; never waits, no heap. What does not fit is dropped and counted.
    void push(std::string_view line);

    /// Whether the reader has gone away.
    [[nodiscard]] bool is_unread() const;

    /// Writes the rest, for two seconds at most. One line about what was not written and why; empty if nothing.
    std::string close();

private:
    static constexpr std::size_t kCapacity = std::size_t{1} << 20U;  // some seconds of poses

    void run();
    bool write_some(std::string_view bytes, std::size_t& written);

    drivers::FileDescriptor owned_;
    int descriptor_;
    std::string name_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::vector<char> ring_;  // made once
    std::size_t begin_ = 0;
    std::size_t size_ = 0;
    std::uint64_t dropped_ = 0;  // lines
    int error_ = 0;              // errno of the write that failed
    bool closing_ = false;
    std::chrono::steady_clock::time_point deadline_;
    std::thread thread_;
};

}  // namespace tricoil::linux_board
