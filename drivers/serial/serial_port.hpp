// Both ends of a serial line.
#pragma once

#include <string>

#include "drivers/serial/stream_port.hpp"

namespace tricoil::drivers {

/// A tty in raw mode with exclusive access. The baud rate is not changed (USB and pseudo terminals have none).
class SerialPort final : public StreamPort {
public:
    explicit SerialPort(std::string path) : path_(std::move(path)) {}

private:
    int open_descriptor() override;
    std::string path_;
};

/// The master of a new pseudo terminal. A SerialPort can open path(). The terminal stays open between close() and open(), so that
/// the path stays valid.
class PtyPort final : public StreamPort {
public:
    /// Empty if no pseudo terminal is available.
    [[nodiscard]] const std::string& path() const { return path_; }
    PtyPort();

private:
    int open_descriptor() override;
    FileDescriptor master_;
    FileDescriptor slave_;  // kept open: otherwise the master hangs up while no other program has the slave open
    std::string path_;
};

}  // namespace tricoil::drivers
