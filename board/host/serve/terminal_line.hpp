// Byte streams for one client: a pseudo terminal or a serial port.
#pragma once

#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Pseudo terminal. Clients open path(). With a link, path() stays the same after a restart.
class PseudoTerminal {
public:
    /// link: symbolic link to create; a link to a closed pseudo terminal is replaced; empty: none. Throws InputError, naming the
    /// link, if another file exists, DeviceError if the system has no pseudo terminal.
    explicit PseudoTerminal(const std::string& link);
    ~PseudoTerminal();
    PseudoTerminal(const PseudoTerminal&) = delete;
    PseudoTerminal& operator=(const PseudoTerminal&) = delete;

    [[nodiscard]] const std::string& path() const { return link_.empty() ? name_ : link_; }
    /// Duplicate of the server's end. The caller closes it.
    [[nodiscard]] int duplicate() const;

private:
    drivers::FileDescriptor master_;
    std::string name_;
    std::string link_;
};

/// Opens a serial port in raw mode at `baud`. Returns -1 on failure; `reason` then holds the reason.
int open_serial(const std::string& path, int baud, std::string& reason);
/// True for a standard speed of serial ports.
bool is_baud(int baud);

}  // namespace tricoil::host
