#include "board/host/serve/stream.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace tricoil::host {

Stream::Stream(int descriptor) : descriptor_(descriptor) {
    ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
    ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
}

bool Stream::send(std::string_view record) {
    if (gone_ || waiting_.size() + record.size() > kMostWaiting) {
        ++dropped_;
        return false;
    }
    waiting_ += record;
    flush();
    return true;
}

void Stream::flush() {
    std::size_t done = 0;
    while (!gone_ && done < waiting_.size()) {
        const ssize_t n = ::write(descriptor_.get(), waiting_.data() + done, waiting_.size() - done);
        if (n > 0) {
            done += static_cast<std::size_t>(n);
        } else if (n < 0 && errno != EINTR) {
            gone_ = errno != EAGAIN;
            break;
        }
    }
    waiting_.erase(0, done);
}

std::span<const char> Stream::receive(std::span<char> buffer) {
    const ssize_t n = ::read(descriptor_.get(), buffer.data(), buffer.size());
    if (n > 0) {
        return buffer.first(static_cast<std::size_t>(n));
    }
    gone_ = gone_ || n == 0 || (errno != EAGAIN && errno != EINTR);
    return {};
}

}  // namespace tricoil::host
