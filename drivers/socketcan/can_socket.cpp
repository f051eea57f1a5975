#include "drivers/socketcan/can_socket.hpp"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::drivers {
namespace {

constexpr int kReceiveBytes = 1 << 20;  // one second of a fully loaded bus

constexpr Status lost() { return {StatusCode::device_lost, "CAN interface is not usable"}; }

template <typename Value>
bool set_option(int fd, int level, int name, const Value& value) {
    return ::setsockopt(fd, level, name, &value, sizeof value) == 0;
}

/// Index of a CAN FD interface; 0, with the reason in `why`, for any other interface.
int fd_interface_index(int fd, const std::string& name, Text& why) {
    ifreq request{};
    if (name.empty() || name.size() >= IFNAMSIZ) {
        why.print("'%s' is not a valid interface name; see: ip -br link show type can", name.c_str());
        return 0;
    }
    std::memcpy(request.ifr_name, name.c_str(), name.size());
    if (::ioctl(fd, SIOCGIFINDEX, &request) != 0) {
        why.print("%s: no such network interface; see: ip -br link show type can", name.c_str());
        return 0;
    }
    const int index = request.ifr_ifindex;
    if (::ioctl(fd, SIOCGIFHWADDR, &request) != 0 || request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
        why.print("%s is not a CAN interface", name.c_str());
        return 0;
    }
    if (::ioctl(fd, SIOCGIFMTU, &request) != 0 || request.ifr_mtu < static_cast<int>(CANFD_MTU)) {
        why.print(
            "%s is a classic CAN interface; messages need CAN FD: ip link set %s down, then type can ... fd on (vcan: mtu 72)",
            name.c_str(), name.c_str());
        return 0;
    }
    return index;
}

void read_times(const cmsghdr& header, CanReception& reception) {
    std::array<timespec, 3> times{};  // software, (unused), hardware
    std::memcpy(times.data(), CMSG_DATA(&header), sizeof times);
    if (times[0].tv_sec != 0) {  // wall-clock time, converted to the monotonic clock
        reception.arrival = host_now() + Microseconds{to_us(times[0]) - clock_us(CLOCK_REALTIME)};
    }
    reception.hardware_time_us = to_us(times[2]);
}

bool is_gone(int error) { return error == ENODEV || error == ENXIO || error == EBADF; }

}  // namespace

Status CanSocket::open(const std::string& interface, std::span<const can_filter> filters, Text& why) {
    fd_.reset(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
    if (!fd_.is_open()) {
        why.print("cannot open CAN socket (%s); is the kernel module can_raw loaded?", std::strerror(errno));
        return lost();
    }
    const int index = fd_interface_index(fd(), interface, why);
    if (index == 0) {
        fd_.reset();
        return lost();
    }
    const int on = 1;
    const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CRTL | CAN_ERR_TX_TIMEOUT;
    const int stamps =
        SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
    bool done = set_option(fd(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on) &&
                set_option(fd(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors) &&
                set_option(fd(), SOL_SOCKET, SO_TIMESTAMPING, stamps) && set_option(fd(), SOL_SOCKET, SO_RXQ_OVFL, on);
    done = done &&
           ::setsockopt(fd(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), static_cast<socklen_t>(filters.size_bytes())) == 0;
    if (!set_option(fd(), SOL_SOCKET, SO_RCVBUFFORCE, kReceiveBytes)) {  // without CAP_NET_ADMIN: up to the system limit
        set_option(fd(), SOL_SOCKET, SO_RCVBUF, kReceiveBytes);
    }
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = index;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): required by the socket interface
    done = done && ::bind(fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    if (!done) {
        why.print("%s: cannot be opened (%s)", interface.c_str(), std::strerror(errno));
        fd_.reset();
        return lost();
    }
    return {};
}

Status CanSocket::send(const protocol::CanFrame& frame, bool& link_down) {
    canfd_frame raw{};
    raw.can_id = frame.id;
    raw.len = frame.length;
    raw.flags = CANFD_BRS;
    std::memcpy(raw.data, frame.data.data(), frame.bytes().size());
    link_down = false;
    if (::write(fd(), &raw, CANFD_MTU) == static_cast<ssize_t>(CANFD_MTU)) {
        return {};
    }
    link_down = errno == ENETDOWN || errno == EINVAL;  // EINVAL: the interface is a classic one again
    return is_gone(errno) ? lost() : Status{StatusCode::not_ready, "send queue is full or the link is down"};
}

Status CanSocket::receive(CanReception& reception) {
    canfd_frame raw{};
    alignas(cmsghdr) std::array<char, 256> control{};
    iovec vector{&raw, sizeof raw};
    msghdr message{};
    message.msg_iov = &vector;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t bytes = ::recvmsg(fd(), &message, 0);
    if (bytes < 0) {
        if (errno == ENETDOWN) {
            return {StatusCode::timed_out, "CAN link is down"};
        }
        return is_gone(errno) ? lost() : Status{StatusCode::not_ready, "no frame"};
    }
    reception = {};
    reception.arrival = host_now();
    reception.is_fd = bytes == static_cast<ssize_t>(CANFD_MTU);
    reception.is_error = (raw.can_id & CAN_ERR_FLAG) != 0;
    reception.frame.id = raw.can_id & CAN_EFF_MASK;
    reception.frame.length = std::min<std::uint8_t>(raw.len, CANFD_MAX_DLEN);
    std::memcpy(reception.frame.data.data(), raw.data, reception.frame.length);
    for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
        if (header->cmsg_level == SOL_SOCKET && header->cmsg_type == SO_TIMESTAMPING) {
            read_times(*header, reception);
        } else if (header->cmsg_level == SOL_SOCKET && header->cmsg_type == SO_RXQ_OVFL) {
            std::memcpy(&reception.dropped, CMSG_DATA(header), sizeof reception.dropped);
        }
    }
    return {};
}

}  // namespace tricoil::drivers
