// Byte streams for one client: a pseudo terminal or a serial port.
#pragma once

#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Pseudo terminal. Clients open path(). With a link, path() stays the same after a restart.
class PseudoTerminal {
public:
    /// link: symbolic link to create; empty: none. A link to a closed pseudo terminal is replaced. Throws InputError, naming the
    /// link, if it cannot be created or is another file or a link to an open pseudo terminal; DeviceError if the system has no
    /// pseudo terminal.
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

/// Opens a serial port in raw mode at `baud`, a speed that is_baud() accepts. Returns -1 on failure; `reason` then has the cause.
int open_serial(const std::string& path, int baud, std::string& reason);
/// Changes the speed of a serial port that is open. No effect if the port is gone.
void set_serial_speed(const std::string& path, int baud);
/// True for a supported speed: 2400, 4800, 9600, 19200, 38400, 57600, 115200 or 230400 baud.
bool is_baud(int baud);

}  // namespace tricoil::host
