#include "drivers/serial/serial_port.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

#include "drivers/posix/raw_terminal.hpp"

namespace tricoil::drivers {
int SerialPort::open_descriptor() {
    FileDescriptor fd(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!fd.is_open()) {
        const char* remedy = errno == EACCES  ? "; add yourself to the group dialout"
                             : errno == EBUSY ? "; another program uses it"
                                              : "; is it plugged in?";
        reason().print("%s: cannot be opened (%s)%s", path_.c_str(), std::strerror(errno), remedy);
        return -1;
    }
    if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {  // TIOCEXCL does not stop root
        reason().print("%s: another program uses it; end that program", path_.c_str());
        return -1;
    }
    if (!make_raw(fd.get())) {
        reason().print("%s: not a serial line", path_.c_str());
        return -1;
    }
    if (::ioctl(fd.get(), TIOCEXCL) != 0) {
        reason().print("%s: cannot lock for exclusive use (%s)", path_.c_str(), std::strerror(errno));
        return -1;
    }
    ::tcflush(fd.get(), TCIOFLUSH);
    return ::fcntl(fd.get(), F_DUPFD_CLOEXEC, 0);
}

PtyPort::PtyPort() { path_ = open_pseudo_terminal(master_, slave_); }

int PtyPort::open_descriptor() {
    const int fd = ::fcntl(master_.get(), F_DUPFD_CLOEXEC, 0);
    if (fd < 0) {
        reason().print("cannot open a pseudo terminal; check that /dev/pts is mounted");
        return -1;
    }
    ::fcntl(fd, F_SETFL, O_NONBLOCK);
    return fd;
}

}  // namespace tricoil::drivers
