// Serves one client at a time on a pseudo terminal or a serial port, and opens these.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "board/host/serve/service.hpp"
#include "board/host/serve/stream.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Session: has receive() and take() as for TcpService, but sends through the function that the factory gets. It continues from
/// one client to the next, like a device on a cable. When a client leaves, the records that wait for it are discarded. Records
/// without a client are not queued.
template <typename Session>
class TerminalService final : public Service {
public:
    /// Returns the descriptor of the line, or -1. Called again, at most once per second, after a failure or an error of the line.
    using Open = std::function<int()>;
    using Factory = std::function<std::unique_ptr<Session>(std::function<void(std::string_view)> send)>;

    /// A hang-up of a pseudo terminal means that no client is there: the same descriptor waits for the next one. A serial port
    /// that hangs up was unplugged: it must be opened again.
    enum class HangUp : std::uint8_t { no_client, line_lost };

    TerminalService(Open open, HangUp hang_up, const Factory& factory)
        : open_(std::move(open)), hang_up_(hang_up), session_(factory([this](std::string_view record) {
              if (stream_ && !hung_up_) {
                  stream_->send(record);
              }
          })) {
        reopen();
    }

    bool watch(std::vector<pollfd>& descriptors) override {
        // poll() returns at once for a terminal without a client, so each round checks it instead.
        if (!stream_ || hung_up_) {
            return false;
        }
        descriptors.push_back({stream_->descriptor(), stream_->events(), 0});
        return stream_->pauses();
    }

    void handle() override {
        if (!stream_) {
            reopen();
            return;
        }
        check_for_hang_up();
        if (!stream_ || hung_up_) {
            return;
        }
        stream_->flush();
        const auto bytes = stream_->receive();
        if (!bytes.empty()) {
            session_->receive(bytes);
        }
        if (stream_->gone()) {
            check_for_hang_up();
            if (stream_ && !hung_up_) {
                stream_.reset();
            }
        }
    }

    void take(std::span<const ServedPose> poses) override { session_->take(poses); }

private:
    void check_for_hang_up() {
        pollfd descriptor{stream_->descriptor(), POLLIN, 0};
        ::poll(&descriptor, 1, 0);
        hung_up_ = (descriptor.revents & POLLHUP) != 0;
        if (hung_up_ && hang_up_ == HangUp::line_lost) {
            stream_.reset();
        } else if (hung_up_) {
            stream_->restart();
        }
    }

    void reopen() {
        const auto now = std::chrono::steady_clock::now();
        if (now - tried_ < std::chrono::seconds(1)) {
            return;
        }
        tried_ = now;
        hung_up_ = false;
        if (const int descriptor = open_(); descriptor >= 0) {
            stream_.emplace(descriptor);
        }
    }

    Open open_;
    HangUp hang_up_;
    std::unique_ptr<Session> session_;
    std::optional<Stream> stream_;
    bool hung_up_ = false;  // no client has the other end open
    std::chrono::steady_clock::time_point tried_{};
};

/// Pseudo terminal. Clients open path(). With a link, path() stays the same after a restart.
class PseudoTerminal {
public:
    /// link: symbolic link to create; empty: none. A link to a closed pseudo terminal is replaced. Throws InputError, naming the
    /// link, if it cannot be created or is another file or a link to an open pseudo terminal; DeviceError if the system has no
    /// pseudo terminal.
    explicit PseudoTerminal(const std::string& link);
    ~PseudoTerminal();

    [[nodiscard]] const std::string& path() const { return link_.empty() ? name_ : link_; }
    /// Duplicate of the server's end. The caller closes it.
    [[nodiscard]] int duplicate() const;

private:
    drivers::FileDescriptor master_;
    std::string name_;
    std::string link_;
};

/// Opens a serial port in raw mode at `baud`, a speed that is_baud() accepts. Returns -1 on failure; `reason` then has the cause.
int open_serial(const std::string& path, int baud, std::string& reason);
/// Changes the speed of a serial port that is open. No effect if the port is gone.
void set_serial_speed(const std::string& path, int baud);
/// True for a supported speed: 2400, 4800, 9600, 19200, 38400, 57600, 115200 or 230400 baud.
bool is_baud(int baud);

}  // namespace tricoil::host
