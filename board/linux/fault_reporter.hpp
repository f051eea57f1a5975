// Says on standard error what is refused and what is wrong with the link: once per kind and second.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "board/linux/device_session.hpp"

namespace tricoil::linux_board {

class FaultReporter {
public:
    explicit FaultReporter(std::string device) : device_(std::move(device)) {}

    /// Compares the counters with what has been told, and tells what is due.
    void look(const DeviceSession& session, const hal::MessagePort& port, std::int64_t now_us);

private:
    std::string device_;
    std::array<std::uint64_t, protocol::kWireErrors> told_{};
    std::array<std::int64_t, protocol::kWireErrors> told_us_{};
    std::array<char, 320> told_detail_{};
    std::int64_t detail_us_ = 0;
};

}  // namespace tricoil::linux_board
