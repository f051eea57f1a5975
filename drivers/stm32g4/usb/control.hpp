// Control requests on endpoint 0 and their answers, without registers.
#pragma once

#include "drivers/stm32g4/usb/descriptors.hpp"

namespace tricoil::stm32g4::usb {

struct SetupPacket {
    std::uint8_t bmRequestType = 0;  // NOLINT(readability-identifier-naming): names of the standard, also below
    std::uint8_t bRequest = 0;       // NOLINT(readability-identifier-naming)
    std::uint16_t wValue = 0;        // NOLINT(readability-identifier-naming)
    std::uint16_t wIndex = 0;        // NOLINT(readability-identifier-naming)
    std::uint16_t wLength = 0;       // NOLINT(readability-identifier-naming)
};
constexpr std::size_t kSetupBytes = 8;

constexpr SetupPacket setup_packet(std::span<const std::uint8_t, kSetupBytes> bytes) {
    const auto word = [bytes](std::size_t at) { return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U); };
    return {bytes[0], bytes[1], word(2), word(4), word(6)};
}

/// Effect of a request on the endpoints.
enum class ControlEffect : std::uint8_t {
    none,
    set_address,  // after the status stage
    configure,    // restart the bulk endpoints
    unconfigure,  // switch the bulk endpoints off
    halt_in,      // answer with stalls
    halt_out,     // answer with stalls
    resume_in,    // restart the endpoint
    resume_out    // restart the endpoint
};

struct ControlAnswer {
    bool accepted = false;  // false: stall
    std::span<const std::uint8_t> data{};
    ControlEffect effect = ControlEffect::none;
};

class Control {
public:
    explicit Control(std::uint64_t serial) : serial_(serial) {}

    /// The answer's data is valid until the next request; it is never longer than requested.
    ControlAnswer on_setup(const SetupPacket& setup);
    /// Bus reset.
    void reset();

    [[nodiscard]] bool is_configured() const { return is_configured_; }
    /// New device address, to be used after the request that set it.
    [[nodiscard]] std::uint8_t address() const { return address_; }

private:
    ControlAnswer to_device(const SetupPacket& setup);
    ControlAnswer to_interface(const SetupPacket& setup);
    ControlAnswer to_endpoint(const SetupPacket& setup);
    ControlAnswer set_configuration(const SetupPacket& setup);
    ControlAnswer descriptor(const SetupPacket& setup);
    ControlAnswer one_byte(std::uint8_t value);
    ControlAnswer status(bool bit_0);

    std::uint64_t serial_;
    StringBuffer buffer_{};
    std::uint8_t address_ = 0;
    bool is_configured_ = false;
    bool is_in_halted_ = false;
    bool is_out_halted_ = false;
};

}  // namespace tricoil::stm32g4::usb
