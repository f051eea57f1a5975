#include "board/linux/line_pump.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "board/support/errors.hpp"

namespace tricoil::linux_board {
namespace {

constexpr std::size_t kPortion = 4096;  // a pipe that is ready accepts this size without blocking (PIPE_BUF)
constexpr int kPollMs = 100;
constexpr std::chrono::seconds kCloseTimeout{2};
constexpr std::chrono::milliseconds kCollectionPause{25};  // collects several lines per system call to save processor time

int make_file(const std::string& path) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0) {
        throw host::InputError(path + ": cannot be written (" + std::strerror(errno) + "); choose another file");
    }
    return descriptor;
}

}  // namespace

LinePump::LinePump(const std::string& path) : LinePump(make_file(path), path) { owned_.reset(descriptor_); }

LinePump::LinePump(int descriptor, std::string name)
    : descriptor_(descriptor), name_(std::move(name)), ring_(kCapacity), thread_([this] { run(); }) {}

LinePump::~LinePump() { close(); }

void LinePump::push(std::string_view line) {
    const std::lock_guard lock(mutex_);
    if (error_ != 0 || size_ + line.size() > ring_.size()) {
        ++dropped_;
        return;
    }
    const std::size_t end = (begin_ + size_) % ring_.size();
    const std::size_t first = std::min(line.size(), ring_.size() - end);
    std::copy_n(line.begin(), first, ring_.begin() + static_cast<std::ptrdiff_t>(end));
    std::copy(line.begin() + first, line.end(), ring_.begin());
    size_ += line.size();
}

bool LinePump::is_unread() const {
    const std::lock_guard lock(mutex_);
    return error_ == EPIPE;
}

bool LinePump::has_failed() const {
    const std::lock_guard lock(mutex_);
    return error_ != 0;
}

LinePump::Depth LinePump::depth() const {
    const std::lock_guard lock(mutex_);
    return {size_, dropped_};
}

void LinePump::run() {
    std::array<char, kPortion> portion{};
    std::unique_lock lock(mutex_);
    for (;;) {
        if (size_ == 0 && !closing_) {
            wake_.wait_for(lock, kCollectionPause, [&] { return closing_; });
            continue;
        }
        if (size_ == 0 || (closing_ && std::chrono::steady_clock::now() > deadline_)) {
            return;
        }
        const std::size_t count = std::min({size_, portion.size(), ring_.size() - begin_});
        std::copy_n(ring_.begin() + static_cast<std::ptrdiff_t>(begin_), count, portion.begin());
        lock.unlock();
        std::size_t written = 0;
        const bool sound = write_some({portion.data(), count}, written);
        lock.lock();
        begin_ = (begin_ + written) % ring_.size();
        size_ -= written;
        if (!sound) {
            error_ = errno;
            return;
        }
    }
}

/// Returns false and sets errno if writing failed. written == 0: try again later.
bool LinePump::write_some(std::string_view bytes, std::size_t& written) {
    pollfd ready{descriptor_, POLLOUT, 0};
    if (::poll(&ready, 1, kPollMs) <= 0) {
        return true;
    }
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    written = count > 0 ? static_cast<std::size_t>(count) : 0;
    return count >= 0 || errno == EINTR || errno == EAGAIN;
}

std::string LinePump::close() {
    if (!thread_.joinable()) {
        return "";
    }
    {
        const std::lock_guard lock(mutex_);
        closing_ = true;
        deadline_ = std::chrono::steady_clock::now() + kCloseTimeout;
    }
    wake_.notify_one();
    thread_.join();
    owned_.reset();
    if (error_ != 0) {
        return fmt::format("{}: poses could not be written completely ({}); is the disk full?", name_, std::strerror(error_));
    }
    for (; size_ > 0; --size_) {
        dropped_ += ring_[(begin_ + size_ - 1) % ring_.size()] == '\n' ? 1 : 0;
    }
    if (dropped_ > 0) {
        return fmt::format("{}: {} poses were dropped, because its reader is too slow", name_, dropped_);
    }
    return "";
}

bool LinePump::takes_more() const {
    pollfd ready{descriptor_, POLLOUT, 0};
    return ::poll(&ready, 1, static_cast<int>(std::chrono::milliseconds(kCloseTimeout).count())) > 0;
}

}  // namespace tricoil::linux_board
