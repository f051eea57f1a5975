#include "board/record/journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "core/base/crc32.hpp"

namespace tricoil::host {
namespace {

/// Number of bytes written. If it is less than the size, errno gives the reason.
std::size_t write_all(int descriptor, std::string_view text) {
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t n = ::write(descriptor, text.data() + done, text.size() - done);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n <= 0) {
            break;
        }
        done += static_cast<std::size_t>(n);
    }
    return done;
}

}  // namespace

Journal::Journal(const std::vector<std::string>& paths, WhenFull when_full, std::span<const std::string> headers,
                 std::function<void()> on_failure)
    : files_(paths.size()), when_full_(when_full), on_failure_(std::move(on_failure)) {
    std::signal(SIGXFSZ, SIG_IGN);  // write() then reports a file size limit like a full disk
    for (std::size_t n = 0; n < paths.size(); ++n) {
        make(paths[n], files_[n]);
        if (n < headers.size()) {
            files_[n].writing = headers[n] + '\n';
            write(files_[n]);
            files_[n].writing.clear();
        }
    }
    thread_ = std::thread([this] { run(); });
}

void Journal::make(const std::string& path, File& file) {
    file.descriptor.reset(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
    if (!file.descriptor.is_open()) {
        throw InputError(path + ": cannot be created (" + std::strerror(errno) + "); choose another folder");
    }
}

Journal::~Journal() { close(); }

void Journal::append(std::size_t n, std::string_view line) {
    if (failed_) {
        return;
    }
    std::unique_lock lock(mutex_);
    std::string& pending = files_[n].pending;
    pending += line;
    pending += '\n';
    if (pending.size() < kMaxPending) {
        return;
    }
    if (when_full_ == WhenFull::end) {
        lock.unlock();
        fail("the disk is too slow");
        return;
    }
    wake_.notify_one();
    drained_.wait(lock, [&] { return pending.empty() || failed_; });
}

void Journal::write_whole(const std::string& path, std::string text) {
    {
        const std::lock_guard lock(mutex_);
        whole_path_ = path;
        whole_text_ = std::move(text);
    }
    wake_.notify_one();
}

void Journal::run() {
    auto synced = std::chrono::steady_clock::now();
    bool is_reported = false;  // the failure
    for (bool last = false; !last;) {
        std::string whole;
        {
            std::unique_lock lock(mutex_);
            wake_.wait_for(lock, kInterval, [this] {
                return ending_ || !whole_text_.empty() || std::any_of(files_.begin(), files_.end(), [](const File& file) {
                           return file.pending.size() >= kMaxPending;
                       });
            });
            last = ending_;
            whole = std::exchange(whole_text_, {});
            for (File& file : files_) {
                std::swap(file.pending, file.writing);
            }
        }
        drained_.notify_all();
        const bool failed_before = failed_;  // if one file fails now, the others are still written
        try {
            if (!whole.empty() && !failed_before) {
                write_whole_file(whole_path_, whole);
            }
        } catch (const std::exception& error) {
            fail(error.what());
        }
        for (File& file : files_) {
            if (!failed_before) {
                write(file);
            }
            file.writing.clear();
        }
        if (const auto now = std::chrono::steady_clock::now(); now - synced >= kSyncInterval || last) {
            synced = now;
            for (const File& file : files_) {
                if (::fdatasync(file.descriptor.get()) != 0 && errno != EINVAL &&
                    errno != ENOTSUP) {  // not supported by some file systems
                    fail(std::strerror(errno));
                }
            }
        }
        if (failed_ && !std::exchange(is_reported, true) && on_failure_) {
            on_failure_();
        }
    }
}

void Journal::write(File& file) {
    const std::size_t done = write_all(file.descriptor.get(), file.writing);
    const std::string reason = done < file.writing.size() ? std::strerror(errno) : "";
    const std::size_t end = std::string_view(file.writing).substr(0, done).rfind('\n');
    const std::string_view whole(file.writing.data(), end == std::string::npos ? 0 : end + 1);
    file.written.lines += static_cast<std::uint64_t>(std::count(whole.begin(), whole.end(), '\n'));
    file.written.bytes += whole.size();
    bytes_ += whole.size();
    file.written.crc32 = crc32_continued(
        file.written.crc32, {reinterpret_cast<const std::uint8_t*>(whole.data()), whole.size()});  // NOLINT: bytes as such
    if (done < file.writing.size()) {
        (void)!::ftruncate(file.descriptor.get(), static_cast<off_t>(file.written.bytes));
        fail(reason);
    }
}

void Journal::fail(const std::string& reason) {
    const std::lock_guard lock(mutex_);
    if (!failed_) {
        reason_ = reason;
        failed_ = true;
    }
    drained_.notify_all();
}

std::string Journal::reason() const {
    const std::lock_guard lock(mutex_);
    return reason_;
}

std::vector<Journal::Extent> Journal::close() {
    std::vector<Extent> extents;
    if (thread_.joinable()) {
        {
            const std::lock_guard lock(mutex_);
            ending_ = true;
        }
        wake_.notify_one();
        thread_.join();
        for (File& file : files_) {
            // run() has flushed it; a disk of another machine may report its errors only now, at each close of a descriptor
            if (const int copy = ::dup(file.descriptor.get()); copy >= 0 && ::close(copy) != 0) {
                fail(std::strerror(errno));
            }
            file.descriptor.reset();
        }
    }
    for (const File& file : files_) {
        extents.push_back(file.written);
    }
    return extents;
}

}  // namespace tricoil::host
