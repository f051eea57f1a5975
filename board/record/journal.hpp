// Line files that grow while a tracker runs. A separate thread writes them, so that a slow disk never delays the tracker.
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
    enum class Patience : std::uint8_t {
        never_wait,  // the journal ends if more than kMostPending bytes wait for the disk
        wait,        // append() waits for the disk: for simulated time
    };
    static constexpr std::chrono::milliseconds kInterval{200};
    static constexpr std::chrono::seconds kSyncInterval{1};
    static constexpr std::size_t kMostPending = std::size_t{64} << 20U;

    /// Creates the files and writes the header line of each at once, so that every file has one even if the program is killed.
    /// Throws InputError if a file cannot be created.
    Journal(const std::vector<std::string>& paths, Patience patience, std::span<const std::string> headers = {});
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// Adds a line, given without line feed, to the n-th file. Lines are dropped after failed().
    void append(std::size_t n, std::string_view line);

    [[nodiscard]] bool failed() const { return failed_; }
    /// Reason of the failure. Call it only after failed().
    [[nodiscard]] std::string why() const;

    /// Writes the remaining lines and closes the files.
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
