// Line files that grow while a tracker runs. A separate thread writes them, so that a slow disk does not delay a live tracker.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// If the program is killed, at most the lines of the last kInterval are lost, and only the last line may be incomplete. If the
/// disk fails, the journal ends after the last complete line that fits.
class Journal {
public:
    /// Size and checksum of a file.
    struct Extent {
        std::uint64_t lines = 0;
        std::uint64_t bytes = 0;
        std::uint32_t crc32 = 0;
    };
    enum class WhenFull : std::uint8_t {
        end,   // the journal ends if more than kMaxPending bytes wait for the disk
        wait,  // append() waits for the disk: for simulated time
    };
    static constexpr std::chrono::milliseconds kInterval{200};
    static constexpr std::chrono::seconds kSyncInterval{1};
    static constexpr std::size_t kMaxPending = std::size_t{64} << 20U;

    /// Creates the files and writes the header line of each at once, so that every file has one even if the program is killed.
    /// Throws InputError if a file cannot be created. on_failure: called once, in the journal's thread, after a failure.
    Journal(const std::vector<std::string>& paths, WhenFull when_full, std::span<const std::string> headers = {},
            std::function<void()> on_failure = {});
    ~Journal();

    /// Adds a line, given without line feed, to the n-th file. Lines are dropped after failed().
    void append(std::size_t n, std::string_view line);
    /// Writes the whole file `path` before further lines, like write_whole_file(). Does not wait for the disk.
    void write_whole(const std::string& path, std::string text);
    /// Ends the journal.
    void fail(const std::string& reason);

    /// Bytes of the lines on the disk, without a system call.
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
    [[nodiscard]] bool failed() const { return failed_; }
    /// Reason of the failure. Call it only after failed().
    [[nodiscard]] std::string reason() const;

    /// Writes the remaining lines and closes the files.
    std::vector<Extent> close();

private:
    struct File {
        drivers::FileDescriptor descriptor;
        std::string pending;
        std::string writing;
        Extent written;
    };

    void make(const std::string& path, File& file);
    void run();
    void write(File& file);

    std::vector<File> files_;
    WhenFull when_full_;
    std::function<void()> on_failure_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable drained_;
    bool ending_ = false;
    std::string whole_path_;
    std::string whole_text_;  // waits to be written; empty: none
    std::atomic<std::uint64_t> bytes_ = 0;
    std::atomic<bool> failed_ = false;
    std::string reason_;
    std::thread thread_;
};

}  // namespace tricoil::host
