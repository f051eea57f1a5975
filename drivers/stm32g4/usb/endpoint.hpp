// Endpoint register. It has bits of three kinds: to keep its value, a bit must be written as 0, as 1, or as its present value.
#pragma once

#include "drivers/stm32g4/registers/usb.hpp"

namespace tricoil::stm32g4 {

enum class EndpointState : std::uint8_t { disabled = 0, stall = 1, nak = 2, valid = 3 };

/// Collects changes of an endpoint register that reads `now`; word() is the value to write, once. The write does not affect
/// other bits, nor changes that the hardware makes to them meanwhile. Change the state only of a direction that is not `valid`:
/// the hardware may change the state of a valid one at any time.
class EndpointChange {
public:
    explicit constexpr EndpointChange(std::uint16_t now)
        : now_(now),
          word_(
              static_cast<std::uint16_t>(usb::EP_CTR_RX | usb::EP_CTR_TX | (now & (usb::EP_TYPE | usb::EP_KIND | usb::EP_EA)))) {}

    constexpr EndpointChange& kind(std::uint16_t type, std::uint8_t address) {
        word_ = static_cast<std::uint16_t>((word_ & ~(usb::EP_TYPE | usb::EP_KIND | usb::EP_EA)) | type | address);
        return *this;
    }
    constexpr EndpointChange& take_received() { return clear(usb::EP_CTR_RX); }
    constexpr EndpointChange& take_sent() { return clear(usb::EP_CTR_TX); }
    constexpr EndpointChange& receive(EndpointState state) {
        return set(usb::EP_STAT_RX, static_cast<unsigned>(state) << usb::EP_STAT_RX_Pos);
    }
    constexpr EndpointChange& send(EndpointState state) {
        return set(usb::EP_STAT_TX, static_cast<unsigned>(state) << usb::EP_STAT_TX_Pos);
    }
    /// The next packet in this direction is a DATA0.
    constexpr EndpointChange& restart_receiving() { return set(usb::EP_DTOG_RX, 0); }
    constexpr EndpointChange& restart_sending() { return set(usb::EP_DTOG_TX, 0); }

    [[nodiscard]] constexpr std::uint16_t word() const { return word_; }

private:
    constexpr EndpointChange& clear(std::uint16_t flag) {
        word_ = static_cast<std::uint16_t>(word_ & ~flag);
        return *this;
    }
    constexpr EndpointChange& set(std::uint16_t mask, unsigned wanted) {
        word_ = static_cast<std::uint16_t>((word_ & ~mask) | ((now_ ^ wanted) & mask));
        return *this;
    }

    std::uint16_t now_;
    std::uint16_t word_;
};

}  // namespace tricoil::stm32g4
