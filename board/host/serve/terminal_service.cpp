#include "board/host/serve/terminal_service.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "board/support/errors.hpp"
#include "drivers/posix/raw_terminal.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

struct Baud {
    int rate;
    speed_t speed;
};
constexpr std::array<Baud, 8> kBauds{{{2400, B2400},
                                      {4800, B4800},
                                      {9600, B9600},
                                      {19200, B19200},
                                      {38400, B38400},
                                      {57600, B57600},
                                      {115200, B115200},
                                      {230400, B230400}}};

speed_t speed_of(int baud) {
    return std::find_if(kBauds.begin(), kBauds.end(), [&](const Baud& b) { return b.rate == baud; })->speed;
}

void make_link(const std::string& link, const std::string& name) {
    std::error_code error;
    const auto status = fs::symlink_status(link, error);
    if (fs::exists(status)) {
        const bool is_ours = fs::is_symlink(status) && fs::read_symlink(link, error).string().starts_with("/dev/pts/");
        refuse_if(!is_ours, "{}: exists and is not a link to a pseudo terminal; choose another path", link);
        const fs::path other = fs::read_symlink(link, error);
        if (other != name && fs::exists(other, error)) {  // a pseudo terminal exists while it is open
            throw InputError(
                fmt::format("{}: links to {}, which is in use; choose another path, or remove the link", link, other.string()));
        }
        fs::remove(link, error);
    }
    fs::create_symlink(name, link, error);
    if (error) {
        throw InputError(fmt::format("{}: cannot be created ({}); choose another path", link, error.message()));
    }
}

}  // namespace

PseudoTerminal::PseudoTerminal(const std::string& link) {
    drivers::FileDescriptor slave;
    name_ = drivers::open_pseudo_terminal(master_, slave);
    if (name_.empty()) {
        throw DeviceError("cannot open a pseudo terminal; is /dev/pts mounted?");
    }
    if (!link.empty()) {
        make_link(link, name_);
        link_ = link;
    }
}

PseudoTerminal::~PseudoTerminal() {
    std::error_code error;
    if (!link_.empty() && fs::read_symlink(link_, error) == name_) {
        fs::remove(link_, error);
    }
}

int PseudoTerminal::duplicate() const { return ::fcntl(master_.get(), F_DUPFD_CLOEXEC, 0); }

bool is_baud(int baud) {
    return std::any_of(kBauds.begin(), kBauds.end(), [&](const Baud& known) { return known.rate == baud; });
}

int open_serial(const std::string& path, int baud, std::string& reason) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        reason = fmt::format("{}: cannot be opened ({}){}", path, std::strerror(errno),
                             errno == EACCES ? "; add yourself to the group dialout" : "; is it plugged in?");
        return -1;
    }
    if (!drivers::make_raw(descriptor, speed_of(baud))) {
        reason = path + ": is not a serial port";
        ::close(descriptor);
        return -1;
    }
    return descriptor;
}

void set_serial_speed(const std::string& path, int baud) {
    const drivers::FileDescriptor line(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (line.is_open()) {
        drivers::make_raw(line.get(), speed_of(baud));
    }
}

}  // namespace tricoil::host
