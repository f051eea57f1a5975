// The two ends of a serial line.
#pragma once

#include <string>

#include "drivers/serial/stream_port.hpp"

namespace tricoil::drivers {

/// A tty: raw, for this program alone. Baud rate as it stands (USB and pseudo terminals have none).
class SerialPort final : public StreamPort {
public:
    explicit SerialPort(std::string path) : path_(std::move(path)) {}

private:
    int open_descriptor() override;
    std::string path_;
};

/// The master of a new pseudo terminal; a SerialPort opens path(). It is kept while closed, so that the path stays valid.
class PtyPort final : public StreamPort {
public:
    /// Empty if the system has no pseudo terminal left.
    [[nodiscard]] const std::string& path() const { return path_; }
    PtyPort();

private:
    int open_descriptor() override;
    FileDescriptor master_;
    FileDescriptor slave_;  // held, so that the master does not hang up while nobody else has it open
    std::string path_;
};

}  // namespace tricoil::drivers
