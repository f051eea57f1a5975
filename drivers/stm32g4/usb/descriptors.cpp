#include "drivers/stm32g4/usb/descriptors.hpp"

#include <string_view>

namespace tricoil::stm32g4::usb {
namespace {

std::span<const std::uint8_t> written(std::string_view text, StringBuffer& buffer) {
    const std::size_t bytes = 2 + 2 * text.size();
    buffer[0] = low(bytes);
    buffer[1] = kStringDescriptor;
    for (std::size_t i = 0; i < text.size(); ++i) {
        buffer[2 + 2 * i] = static_cast<std::uint8_t>(text[i]);
        buffer[3 + 2 * i] = 0;
    }
    return std::span(buffer).first(bytes);
}

}  // namespace

std::span<const std::uint8_t> string_descriptor(std::uint8_t index, std::uint64_t serial, StringBuffer& buffer) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    static constexpr std::array<std::uint8_t, 4> kLanguages{4, kStringDescriptor, 0x09, 0x04};
    switch (index) {
        case 0:
            return kLanguages;
        case 1:
            return written("tricoil", buffer);
        case 2:
            return written("tracker board", buffer);
        case 3: {
            std::array<char, 16> text{};
            for (std::size_t i = 0; i < text.size(); ++i) {
                text[i] = kDigits[serial >> (60 - 4 * i) & 0xFU];
            }
            return written({text.data(), text.size()}, buffer);
        }
        default:
            return {};
    }
}

}  // namespace tricoil::stm32g4::usb
