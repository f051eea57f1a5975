// Framed messages on a descriptor: serial line or pseudo terminal.
#pragma once

#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "core/protocol/stream_framing.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/poll.hpp"
#include "drivers/posix/reporting_port.hpp"

namespace tricoil::drivers {

class StreamPort : public ReportingPort {
private:
    /// Returns an open non-blocking descriptor; -1, with the reason in reason(), on failure.
    virtual int open_descriptor() = 0;

    Status do_open() final {
        fd_.reset(open_descriptor());
        reader_.reset();
        received_size_ = received_at_ = unsent_size_ = 0;
        if (!fd_.is_open()) {
            return {StatusCode::device_lost, "serial line cannot be opened"};
        }
        reason().clear();
        return {};
    }
    /// Ends the exclusive access, because another process may still hold a descriptor of the line.
    void do_close() final {
        ::ioctl(fd_.get(), TIOCNXCL);
        fd_.reset();
    }
    Status do_send(std::span<const std::uint8_t> message) final {
        if (message.empty() || message.size() > protocol::kMaxMessageBytes) {
            return {StatusCode::invalid_argument, "message is empty or too long"};
        }
        if (!flush()) {
            return lost("writing failed");
        }
        const std::size_t bytes = protocol::frame(message, std::span(unsent_).subspan(unsent_size_));
        if (bytes == 0) {
            ++counts().send_queue_full;
            return {StatusCode::not_ready, "the send queue is full: the line is too slow"};
        }
        unsent_size_ += bytes;
        return flush() ? Status{} : lost("writing failed");
    }
    Status do_receive(hal::ReceivedMessage& message) final {
        if (!flush()) {
            return lost("writing failed");
        }
        for (;;) {
            while (received_at_ < received_size_) {
                if (reader_.push(received_[received_at_++])) {
                    message = {reader_.message(), received_time_, 0};
                    return {};
                }
                damaged().count(reader_.error());
            }
            const ssize_t bytes = ::read(fd_.get(), received_.data(), received_.size());
            if (bytes == 0) {
                errno = EPIPE;  // read() does not set errno at the end of file
            }
            if (bytes == 0 || (bytes < 0 && errno != EAGAIN && errno != EINTR)) {
                return lost("the other end is gone");
            }
            if (bytes < 0) {
                return {StatusCode::not_ready, "no message"};
            }
            received_time_ = host_now();
            received_size_ = static_cast<std::size_t>(bytes);
            received_at_ = 0;
        }
    }
    Status do_wait(Microseconds timeout) final {
        return received_at_ < received_size_ ? Status{} : wait_readable(fd_.get(), timeout);
    }

    /// Writes pending bytes; false if the line is gone.
    bool flush() {
        while (unsent_size_ > 0) {
            const ssize_t written = ::write(fd_.get(), unsent_.data(), unsent_size_);
            if (written < 0) {
                return errno == EAGAIN || errno == EINTR;
            }
            unsent_size_ -= static_cast<std::size_t>(written);
            std::memmove(unsent_.data(), unsent_.data() + written, unsent_size_);
        }
        return true;
    }
    Status lost(const char* what) {
        ++counts().link_losses;
        reason().print("serial line: %s (%s)", what, std::strerror(errno));
        return {StatusCode::device_lost, "serial line is gone"};
    }

    FileDescriptor fd_;
    protocol::StreamReader reader_;
    std::array<std::uint8_t, 4096> received_{};
    std::size_t received_size_ = 0;
    std::size_t received_at_ = 0;
    HostTime received_time_{};
    std::array<std::uint8_t, 2 * protocol::kMaxFramedBytes> unsent_{};
    std::size_t unsent_size_ = 0;
};

}  // namespace tricoil::drivers
