// Lines of bytes on which one client sits: a pseudo terminal that we make, or a serial port.
#pragma once

#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// A pseudo terminal; programs open path(). With a link, path() is the same from one start to the next.
class PseudoTerminal {
public:
    /// link: made, or taken over if it is a link to a pseudo terminal that is no more; empty: none. Throws InputError, naming the
    /// link, if there is something else; DeviceError if the system has no pseudo terminal.
    explicit PseudoTerminal(const std::string& link);
    ~PseudoTerminal();
    PseudoTerminal(const PseudoTerminal&) = delete;
    PseudoTerminal& operator=(const PseudoTerminal&) = delete;

    [[nodiscard]] const std::string& path() const { return link_.empty() ? name_ : link_; }
    /// Our end, duplicated; the caller closes it.
    [[nodiscard]] int duplicate() const;

private:
    drivers::FileDescriptor master_;
    std::string name_;
    std::string link_;
};

/// A serial port, raw, at `baud`. -1, and `why` says why not, if it cannot be had.
int open_serial(const std::string& path, int baud, std::string& why);
/// Whether serial ports have that speed.
bool is_baud(int baud);

}  // namespace tricoil::host
