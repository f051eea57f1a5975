// A raw CAN socket: opens, sends and receives single frames with timestamps.
#pragma once

#include <linux/can.h>
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
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "core/base/status.hpp"
#include "core/base/time.hpp"
#include "core/protocol/can_mapping.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/text.hpp"

namespace tricoil::drivers {

/// One frame from the kernel.
struct CanReception {
    protocol::CanFrame frame;
    bool is_error = false;  // an error frame: `frame.id` holds its class bits
    bool is_fd = false;
    HostTime arrival{};
    std::int64_t hardware_time_us = 0;
    std::uint32_t dropped = 0;  // dropped by the kernel since the socket was opened, because its buffer was full
};

class CanSocket {
public:
    /// Binds to the interface; receives identifiers that match a filter, and error frames. Sets `reason` if not ok. device_lost:
    /// no such interface, not a CAN interface, classic CAN only, or no permission. An interface that is down is not an error.
    Status open(const std::string& interface, std::span<const can_filter> filters, Text& reason) {
        fd_.reset(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
        if (!fd_.is_open()) {
            reason.print("cannot open CAN socket (%s); is the kernel module can_raw loaded?", std::strerror(errno));
            return lost();
        }
        const int index = fd_interface_index(fd(), interface, reason);
        if (index == 0) {
            fd_.reset();
            return lost();
        }
        const int on = 1;
        const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_CRTL | CAN_ERR_TX_TIMEOUT;
        const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_HARDWARE |
                           SOF_TIMESTAMPING_RAW_HARDWARE;
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
            reason.print("%s: cannot be opened (%s)", interface.c_str(), std::strerror(errno));
            fd_.reset();
            return lost();
        }
        return {};
    }
    void close() { fd_.reset(); }

    /// ok; not_ready: the queue is full, or the link is down (then `link_down` is true); device_lost: the interface is gone.
    Status send(const protocol::CanFrame& frame, bool& link_down) {
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

    /// ok; not_ready: no frame; timed_out: the link went down; device_lost: the interface is gone.
    Status receive(CanReception& reception) {
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

    [[nodiscard]] int fd() const { return fd_.get(); }
    [[nodiscard]] bool is_open() const { return fd_.is_open(); }

private:
    static constexpr int kReceiveBytes = 1 << 20;  // one second of a fully loaded bus
    static constexpr Status lost() { return {StatusCode::device_lost, "CAN interface is not usable"}; }
    template <typename Value>
    static bool set_option(int fd, int level, int name, const Value& value) {
        return ::setsockopt(fd, level, name, &value, sizeof value) == 0;
    }
    /// Index of a CAN FD interface; 0, with the reason in `reason`, for any other interface.
    static int fd_interface_index(int fd, const std::string& name, Text& reason) {
        ifreq request{};
        if (name.empty() || name.size() >= IFNAMSIZ) {
            reason.print("'%s' is not a valid interface name; see: ip -br link show type can", name.c_str());
            return 0;
        }
        std::memcpy(request.ifr_name, name.c_str(), name.size());
        if (::ioctl(fd, SIOCGIFINDEX, &request) != 0) {
            reason.print("%s: no such network interface; see: ip -br link show type can", name.c_str());
            return 0;
        }
        const int index = request.ifr_ifindex;
        if (::ioctl(fd, SIOCGIFHWADDR, &request) != 0 || request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
            reason.print("%s is not a CAN interface", name.c_str());
            return 0;
        }
        if (::ioctl(fd, SIOCGIFMTU, &request) != 0 || request.ifr_mtu < static_cast<int>(CANFD_MTU)) {
            reason.print(
                "%s is a classic CAN interface; messages need CAN FD: ip link set %s down, then type can ... fd on (vcan: mtu "
                "72)",
                name.c_str(), name.c_str());
            return 0;
        }
        return index;
    }
    static void read_times(const cmsghdr& header, CanReception& reception) {
        std::array<timespec, 3> times{};  // software, (unused), hardware
        std::memcpy(times.data(), CMSG_DATA(&header), sizeof times);
        if (times[0].tv_sec != 0) {  // wall-clock time, converted to the monotonic clock
            reception.arrival = host_now() + Microseconds{to_us(times[0]) - clock_us(CLOCK_REALTIME)};
        }
        reception.hardware_time_us = to_us(times[2]);
    }
    static bool is_gone(int error) { return error == ENODEV || error == ENXIO || error == EBADF; }

    FileDescriptor fd_;
};

}  // namespace tricoil::drivers
