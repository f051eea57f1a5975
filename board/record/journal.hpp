// Files of lines that grow while a tracker runs: written by a thread of their own, so that no disk ever holds the tracker up.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace tricoil::host {

/// A killed program loses at most the lines of the last kInterval, and leaves whole lines behind but for perhaps the last; a disk
/// that fails ends the journal after the last whole line that fits.
class Journal {
public:
    /// What a file has come to.
    struct Extent {
        std::uint64_t lines = 0;
        std::uint64_t bytes = 0;
        std::uint32_t crc32 = 0;
    };
    enum class Patience : std::uint8_t {
        never_wait,  // a disk that falls behind by kMostPending bytes ends the journal
        wait,        // append() waits for it: where time is simulated
    };
    static constexpr std::chrono::milliseconds kInterval{200};
    static constexpr std::chrono::seconds kSyncInterval{1};
    static constexpr std::size_t kMostPending = std::size_t{64} << 20U;

    /// Makes the files, and writes `headers`, a line each, at once: a program that is killed leaves no file without one. Throws
    /// InputError if a file cannot be made.
    Journal(const std::vector<std::string>& paths, Patience patience, std::span<const char* const> headers = {});
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// Adds a line, without its end, to the n-th file. Lines are dropped once failed().
    void append(std::size_t n, std::string_view line);

    [[nodiscard]] bool failed() const { return failed_; }
    /// Of the failure; call it once failed().
    [[nodiscard]] std::string why() const;

    /// Writes the rest and closes.
    std::vector<Extent> close();

private:
    struct File {
        int descriptor = -1;
        std::string pending;
        std::string writing;
        Extent written;
    };

    void make(const std::string& path, File& file);
    void run();
    void write(File& file);
    void fail(const std::string& why);

    std::vector<File> files_;
    Patience patience_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable drained_;
    bool ending_ = false;
    std::atomic<bool> failed_ = false;
    std::string why_;
    std::thread thread_;
};

}  // namespace tricoil::host
