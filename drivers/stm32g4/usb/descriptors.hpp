// USB descriptors of the board (USB 2.0 chapter 9; BOS: USB 3.2 section 9.6.2; Microsoft OS 2.0 descriptors).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/protocol/usb_id.hpp"

namespace tricoil::stm32g4::usb {

constexpr std::uint8_t kControlPacketBytes = 64;
constexpr std::uint8_t kBulkPacketBytes = 64;
constexpr std::uint8_t kEndpointIn = 0x81;
constexpr std::uint8_t kEndpointOut = 0x01;

constexpr std::uint8_t kDeviceDescriptor = 1;
constexpr std::uint8_t kConfigurationDescriptor = 2;
constexpr std::uint8_t kStringDescriptor = 3;
constexpr std::uint8_t kInterfaceDescriptor = 4;
constexpr std::uint8_t kEndpointDescriptor = 5;
constexpr std::uint8_t kBosDescriptor = 15;
constexpr std::uint8_t kCapabilityDescriptor = 16;

constexpr std::uint8_t kVendorClass = 0xFF;
constexpr std::uint8_t kBulk = 2;
constexpr std::uint8_t kPlatformCapability = 5;

/// Vendor request with which Windows reads its descriptors.
constexpr std::uint8_t kMicrosoftRequest = 0x20;
constexpr std::uint16_t kMicrosoftIndex = 7;

constexpr std::uint8_t low(std::size_t value) { return static_cast<std::uint8_t>(value); }
constexpr std::uint8_t high(std::size_t value) { return static_cast<std::uint8_t>(value >> 8U); }

template <std::size_t... kBytes>
constexpr auto joined(const std::array<std::uint8_t, kBytes>&... parts) {
    std::array<std::uint8_t, (kBytes + ...)> all{};
    auto to = all.begin();
    ((to = std::copy(parts.begin(), parts.end(), to)), ...);
    return all;
}
template <typename... Values>
constexpr auto bytes(Values... values) {
    return std::array{static_cast<std::uint8_t>(values)...};
}
/// Little-endian.
template <typename... Values>
constexpr auto words(Values... values) {
    return joined(std::array{low(values), high(values)}...);
}
/// With the terminating zero.
template <std::size_t kLength>
constexpr auto utf16(const char (&text)[kLength]) {
    std::array<std::uint8_t, 2 * kLength> all{};
    for (std::size_t i = 0; i < kLength; ++i) {
        all[2 * i] = static_cast<std::uint8_t>(text[i]);
    }
    return all;
}

/// USB 2.01: the lowest version for which a host reads the BOS descriptor.
inline constexpr auto kDevice = joined(bytes(18, kDeviceDescriptor, 0x01, 0x02, kVendorClass, 0, 0, kControlPacketBytes),
                                       words(protocol::kUsbVendor, protocol::kUsbProduct), bytes(0x00, 0x01, 1, 2, 3, 1));

constexpr std::uint8_t kSelfPowered = 0x40;

constexpr auto bulk_endpoint(std::uint8_t address) {
    return bytes(7, kEndpointDescriptor, address, kBulk, kBulkPacketBytes, 0, 0);
}

/// One configuration without bus current; one interface with the product's name and two endpoints.
inline constexpr auto kConfiguration = joined(bytes(9, kConfigurationDescriptor, 32, 0, 1, 1, 0, 0x80 | kSelfPowered, 0),
                                              bytes(9, kInterfaceDescriptor, 0, 0, 2, kVendorClass, 0, 0, 2),
                                              bulk_endpoint(kEndpointIn), bulk_endpoint(kEndpointOut));

/// Microsoft OS 2.0 descriptor set: selects the driver WinUSB on Windows and states the GUID by which programs find the device.
constexpr std::size_t kMicrosoftHeaderBytes = 10;
constexpr std::size_t kMicrosoftCompatibleBytes = 20;
constexpr char kPropertyName[] = "DeviceInterfaceGUIDs";
constexpr char kPropertyData[] = "{0e7fbf4d-3b3b-43b1-9585-6a757d26ffa8}\0";  // a list of strings, which ends with two zeros
constexpr std::size_t kMicrosoftPropertyBytes = 10 + 2 * sizeof kPropertyName + 2 * sizeof kPropertyData;
constexpr std::size_t kMicrosoftBytes = kMicrosoftHeaderBytes + kMicrosoftCompatibleBytes + kMicrosoftPropertyBytes;
constexpr std::size_t kWindowsVersionHigh = 0x0603;
constexpr std::size_t kMultiString = 7;

inline constexpr auto kMicrosoftSet =
    joined(words(kMicrosoftHeaderBytes, 0, 0, kWindowsVersionHigh, kMicrosoftBytes),  // set header
           words(kMicrosoftCompatibleBytes, 3),                                       // compatible identifier, no second one
           bytes('W', 'I', 'N', 'U', 'S', 'B'), std::array<std::uint8_t, 10>{},
           words(kMicrosoftPropertyBytes, 4, kMultiString),  // registry property
           words(2 * sizeof kPropertyName), utf16(kPropertyName), words(2 * sizeof kPropertyData), utf16(kPropertyData));
static_assert(kMicrosoftSet.size() == kMicrosoftBytes);

inline constexpr auto kBos =
    joined(bytes(5, kBosDescriptor, 33, 0, 1), bytes(28, kCapabilityDescriptor, kPlatformCapability, 0),
           // UUID of the Microsoft platform capability
           bytes(0xDF, 0x60, 0xDD, 0xD8, 0x89, 0x45, 0xC7, 0x4C, 0x9C, 0xD2, 0x65, 0x9D, 0x9E, 0x64, 0x8A, 0x9F),
           bytes(0x00, 0x00, 0x03, 0x06), words(kMicrosoftBytes), bytes(kMicrosoftRequest, 0));

/// Strings, written on request: 0 languages (US English), 1 manufacturer, 2 product, 3 serial number in 16 hexadecimal digits.
/// Empty: no such string.
using StringBuffer = std::array<std::uint8_t, 2 + 2 * 16>;
std::span<const std::uint8_t> string_descriptor(std::uint8_t index, std::uint64_t serial, StringBuffer& buffer);

}  // namespace tricoil::stm32g4::usb
