#include "drivers/stm32g4/usb/control.hpp"

#include <algorithm>

namespace tricoil::stm32g4::usb {
namespace {

// bmRequestType
constexpr std::uint8_t kToHost = 0x80;
constexpr std::uint8_t kWholeDevice = 0x00;
constexpr std::uint8_t kInterface = 0x01;
constexpr std::uint8_t kEndpoint = 0x02;
constexpr std::uint8_t kVendorToHost = 0xC0;

// bRequest
constexpr std::uint8_t kGetStatus = 0;
constexpr std::uint8_t kClearFeature = 1;
constexpr std::uint8_t kSetFeature = 3;
constexpr std::uint8_t kSetAddress = 5;
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint8_t kGetConfiguration = 8;
constexpr std::uint8_t kSetConfiguration = 9;
constexpr std::uint8_t kGetInterface = 10;
constexpr std::uint8_t kSetInterface = 11;

constexpr std::uint16_t kEndpointHalt = 0;
constexpr std::uint8_t kHighestAddress = 127;

constexpr bool answers_with_data(const SetupPacket& setup) {
    return setup.bmRequestType == kVendorToHost || setup.bRequest == kGetStatus || setup.bRequest == kGetDescriptor ||
           setup.bRequest == kGetConfiguration || setup.bRequest == kGetInterface;
}

constexpr ControlAnswer refused() { return {}; }
constexpr ControlAnswer done(ControlEffect effect = ControlEffect::none) { return {true, {}, effect}; }

}  // namespace

void Control::reset() {
    address_ = 0;
    is_configured_ = is_in_halted_ = is_out_halted_ = false;
}

ControlAnswer Control::on_setup(const SetupPacket& setup) {
    const bool to_host = (setup.bmRequestType & kToHost) != 0;
    if (!to_host && setup.wLength != 0) {
        return refused();  // no supported request sends data to the device
    }
    if (to_host != answers_with_data(setup)) {
        return refused();
    }
    ControlAnswer answer;
    switch (setup.bmRequestType & ~kToHost) {
        case kWholeDevice:
            answer = to_device(setup);
            break;
        case kInterface:
            answer = to_interface(setup);
            break;
        case kEndpoint:
            answer = to_endpoint(setup);
            break;
        default:
            if (setup.bmRequestType == kVendorToHost && setup.bRequest == kMicrosoftRequest && setup.wIndex == kMicrosoftIndex) {
                answer = {true, kMicrosoftSet};
            }
    }
    answer.data = answer.data.first(std::min<std::size_t>(answer.data.size(), setup.wLength));
    return answer;
}

ControlAnswer Control::to_device(const SetupPacket& setup) {
    switch (setup.bRequest) {
        case kGetStatus:
            return status(true);  // self-powered
        case kSetAddress:
            if (setup.wValue > kHighestAddress || setup.wIndex != 0) {
                return refused();
            }
            address_ = static_cast<std::uint8_t>(setup.wValue);
            return done(ControlEffect::set_address);
        case kGetDescriptor:
            return descriptor(setup);
        case kGetConfiguration:
            return one_byte(is_configured_ ? 1 : 0);
        case kSetConfiguration:
            return set_configuration(setup);
        default:
            return refused();
    }
}

ControlAnswer Control::set_configuration(const SetupPacket& setup) {
    if (setup.wValue > 1) {
        return refused();
    }
    is_configured_ = setup.wValue == 1;
    is_in_halted_ = is_out_halted_ = false;
    return done(is_configured_ ? ControlEffect::configure : ControlEffect::unconfigure);
}

ControlAnswer Control::to_interface(const SetupPacket& setup) {
    if (!is_configured_ || setup.wIndex != 0) {
        return refused();
    }
    switch (setup.bRequest) {
        case kGetStatus:
            return status(false);
        case kGetInterface:
            return one_byte(0);
        case kSetInterface:
            if (setup.wValue != 0) {
                return refused();
            }
            is_in_halted_ = is_out_halted_ = false;
            return done(ControlEffect::configure);
        default:
            return refused();
    }
}

ControlAnswer Control::to_endpoint(const SetupPacket& setup) {
    const bool is_in = setup.wIndex == kEndpointIn;
    const bool is_control = (setup.wIndex & 0x7FU) == 0;
    if (!is_control && (!is_configured_ || (!is_in && setup.wIndex != kEndpointOut))) {
        return refused();
    }
    bool& halted = is_in ? is_in_halted_ : is_out_halted_;
    if (setup.bRequest == kGetStatus) {
        return status(!is_control && halted);
    }
    const bool sets = setup.bRequest == kSetFeature;
    if ((!sets && setup.bRequest != kClearFeature) || setup.wValue != kEndpointHalt) {
        return refused();
    }
    if (is_control) {
        return done();
    }
    halted = sets;
    return sets ? done(is_in ? ControlEffect::halt_in : ControlEffect::halt_out)
                : done(is_in ? ControlEffect::resume_in : ControlEffect::resume_out);
}

ControlAnswer Control::descriptor(const SetupPacket& setup) {
    const auto index = static_cast<std::uint8_t>(setup.wValue);
    switch (setup.wValue >> 8U) {
        case kDeviceDescriptor:
            return {true, kDevice};
        case kConfigurationDescriptor:
            return index == 0 ? ControlAnswer{true, kConfiguration} : refused();
        case kStringDescriptor: {
            const auto text = string_descriptor(index, serial_, buffer_);
            return {!text.empty(), text};
        }
        case kBosDescriptor:
            return {true, kBos};
        default:
            return refused();  // also the device qualifier, because there is no other speed
    }
}

ControlAnswer Control::one_byte(std::uint8_t value) {
    buffer_[0] = value;
    return {true, std::span(buffer_).first(1)};
}

ControlAnswer Control::status(bool bit_0) {
    buffer_[0] = bit_0 ? 1 : 0;
    buffer_[1] = 0;
    return {true, std::span(buffer_).first(2)};
}

}  // namespace tricoil::stm32g4::usb
