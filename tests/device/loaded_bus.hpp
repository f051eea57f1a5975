// Loads a CAN bus with foreign frames, synchronised with our traffic.
#pragma once

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <string>
#include <thread>

#include "core/protocol/can_mapping.hpp"

namespace tricoil::test {

/// Sends foreign frames after each column of node 0 until the bus has the given load: bus time of all frames at 500 kbit/s (data
/// phase of FD frames at 2 Mbit/s) relative to the time between columns. Stuff bits are not counted, so a real bus would have a
/// higher load.
class LoadedBus {
public:
    LoadedBus(const std::string& interface, double load, double columns_hz) : load_(load), columns_hz_(columns_hz) {
        socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
        const int on = 1;
        EXPECT_EQ(::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on), 0);
        const int roomy = 1 << 20;
        ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &roomy, sizeof roomy);
        sockaddr_can address{};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
        EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0) << interface;
        thread_ = std::thread([this] { serve(); });
    }
    LoadedBus(const LoadedBus&) = delete;
    LoadedBus& operator=(const LoadedBus&) = delete;
    ~LoadedBus() { stop(); }

    void stop() {
        ending_ = true;
        if (thread_.joinable()) {
            thread_.join();
            ::close(socket_);
        }
    }

    /// Results; valid after stop().
    [[nodiscard]] double load() const { return busy_s_ / (static_cast<double>(columns_) / columns_hz_); }
    [[nodiscard]] std::uint64_t foreign() const { return foreign_; }
    [[nodiscard]] std::uint64_t ours() const { return ours_; }

private:
    static constexpr double kArbitration_s = 1 / 500e3;
    static constexpr double kData_s = 1 / 2e6;

    /// Bus time of a frame by ISO 11898-1: a classic frame has 47 bits besides its data (67 with a long identifier); of an FD
    /// frame about 29 bits have the slow rate, and length, CRC and data have the fast rate.
    static double time_of(const canfd_frame& frame, bool is_fd) {
        const double data = 8.0 * frame.len;
        const double longer = (frame.can_id & CAN_EFF_FLAG) != 0 ? 20 : 0;
        return is_fd ? (29 + longer) * kArbitration_s + (data + 5 + (frame.len > 16 ? 26 : 21)) * kData_s
                     : (47 + longer + data) * kArbitration_s;
    }

    void serve() {
        pollfd readable{socket_, POLLIN, 0};
        while (!ending_) {
            canfd_frame frame{};
            if (::poll(&readable, 1, 20) <= 0) {
                continue;
            }
            const ssize_t bytes = ::read(socket_, &frame, sizeof frame);
            if (bytes < static_cast<ssize_t>(CAN_MTU)) {
                continue;
            }
            ++ours_;
            busy_s_ += time_of(frame, bytes == static_cast<ssize_t>(CANFD_MTU));
            if (frame.can_id == protocol::can_id(protocol::MessageType::column, 0)) {
                ++columns_;
                fill();
            }
        }
    }

    /// Foreign frames of other nodes, other identifiers and other kinds, classic and FD.
    void fill() {
        while (busy_s_ < load_ * static_cast<double>(columns_) / columns_hz_) {
            canfd_frame frame{};
            const bool is_fd = foreign_ % 4 == 3;
            constexpr std::array<canid_t, 4> kIds{0x145, 0x7A0, 0x12345678 | CAN_EFF_FLAG, 0x0F0};
            frame.can_id = kIds[foreign_ % kIds.size()];
            frame.len = is_fd ? 64 : 8;
            std::memset(frame.data, static_cast<int>(foreign_ & 0xFFU), frame.len);
            if (::write(socket_, &frame, is_fd ? CANFD_MTU : CAN_MTU) < 0) {
                return;  // the queue is full; tried again at the next column
            }
            ++foreign_;
            busy_s_ += time_of(frame, is_fd);
        }
    }

    double load_;
    double columns_hz_;
    int socket_ = -1;
    std::thread thread_;
    std::atomic<bool> ending_{false};
    double busy_s_ = 0;
    std::uint64_t columns_ = 0;
    std::uint64_t foreign_ = 0;
    std::uint64_t ours_ = 0;
};

}  // namespace tricoil::test
