#include "board/host/serve/stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace tricoil::host {

Stream::Stream(int descriptor, const StreamLimits& limits)
    : descriptor_(descriptor), oldest_(limits.oldest), share_(limits.share) {
    if (limits.socket_bytes > 0) {
        ::setsockopt(descriptor, SOL_SOCKET, SO_SNDBUF, &limits.socket_bytes, sizeof limits.socket_bytes);
    }
    ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
    ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
}

bool Stream::send(std::string_view record) {
    drop_old();
    if (gone_) {
        return false;
    }
    if (has_waiting() && bytes_waiting_ + record.size() > kMaxWaiting) {
        ++dropped_;
        return false;
    }
    waiting_.push_back({std::string(record), Clock::now()});
    bytes_waiting_ += record.size();
    flush();
    return true;
}

void Stream::drop_old() {
    const auto limit = Clock::now() - oldest_;
    const auto begin = waiting_.begin() + (has_waiting() && waiting_.front().begun ? 1 : 0);
    auto end = begin;
    for (; end != waiting_.end() && end->since < limit; ++end) {
        bytes_waiting_ -= end->bytes.size();
        ++dropped_;
    }
    waiting_.erase(begin, end);
}

void Stream::forget_all() {
    waiting_.clear();
    bytes_waiting_ = 0;
}

void Stream::flush() {
    drop_old();
    while (!gone_ && has_waiting()) {
        Record& record = waiting_.front();
        const ssize_t n = ::write(descriptor_.get(), record.bytes.data(), record.bytes.size());
        if (n < 0 && errno != EINTR) {
            gone_ = errno != EAGAIN;
            return;
        }
        const auto done = static_cast<std::size_t>(std::max<ssize_t>(n, 0));
        record.begun = record.begun || done > 0;
        record.bytes.erase(0, done);
        bytes_waiting_ -= done;
        if (record.bytes.empty()) {
            waiting_.pop_front();
        }
    }
}

short Stream::events() const { return static_cast<short>((may_receive() ? POLLIN : 0) | (has_waiting() ? POLLOUT : 0)); }

std::span<const char> Stream::receive() {
    if (!may_receive()) {
        return {};
    }
    const ssize_t n = ::read(descriptor_.get(), share_.data(), share_.size());
    if (n == std::ssize(share_)) {
        next_share_ = Clock::now() + kSharePause;
    }
    if (n > 0) {
        return std::span<const char>(share_).first(static_cast<std::size_t>(n));
    }
    gone_ = gone_ || n == 0 || (errno != EAGAIN && errno != EINTR);
    return {};
}

}  // namespace tricoil::host
