// USB descriptors of the board (USB 2.0 chapter 9; BOS: USB 3.2 section 9.6.2; Microsoft OS 2.0 descriptors).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tricoil::stm32g4::usb {

/// Test identifier of pid.codes; a product needs its own.
constexpr std::uint16_t kVendor = 0x1209;
constexpr std::uint16_t kProduct = 0x0001;

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

/// USB 2.01: the lowest version for which a host reads the BOS descriptor.
inline constexpr std::array<std::uint8_t, 18> kDevice{18,
                                                      kDeviceDescriptor,
                                                      0x01,
                                                      0x02,
                                                      kVendorClass,
                                                      0,
                                                      0,
                                                      kControlPacketBytes,
                                                      low(kVendor),
                                                      high(kVendor),
                                                      low(kProduct),
                                                      high(kProduct),
                                                      0x00,
                                                      0x01,
                                                      1,
                                                      2,
                                                      3,
                                                      1};

constexpr std::uint8_t kSelfPowered = 0x40;

inline constexpr std::array<std::uint8_t, 32> kConfiguration{9,
                                                             kConfigurationDescriptor,
                                                             32,
                                                             0,
                                                             1,
                                                             1,
                                                             0,
                                                             0x80 | kSelfPowered,
                                                             0,  // one interface, configuration 1, no bus current
                                                             9,
                                                             kInterfaceDescriptor,
                                                             0,
                                                             0,
                                                             2,
                                                             kVendorClass,
                                                             0,
                                                             0,
                                                             2,  // interface 0, two endpoints, the product's name
                                                             7,
                                                             kEndpointDescriptor,
                                                             kEndpointIn,
                                                             kBulk,
                                                             kBulkPacketBytes,
                                                             0,
                                                             0,  //
                                                             7,
                                                             kEndpointDescriptor,
                                                             kEndpointOut,
                                                             kBulk,
                                                             kBulkPacketBytes,
                                                             0,
                                                             0};  //

/// Microsoft OS 2.0 descriptor set: selects the driver WinUSB on Windows and states the GUID by which programs find the device.
constexpr std::size_t kMicrosoftHeaderBytes = 10;
constexpr std::size_t kMicrosoftCompatibleBytes = 20;
constexpr char kPropertyName[] = "DeviceInterfaceGUIDs";
constexpr char kPropertyData[] = "{0e7fbf4d-3b3b-43b1-9585-6a757d26ffa8}\0";  // a list of strings, which ends with two zeros
constexpr std::size_t kMicrosoftPropertyBytes = 10 + 2 * sizeof kPropertyName + 2 * sizeof kPropertyData;
constexpr std::size_t kMicrosoftBytes = kMicrosoftHeaderBytes + kMicrosoftCompatibleBytes + kMicrosoftPropertyBytes;

namespace detail {
/// Fills an array from its beginning.
template <std::size_t kBytes>
struct Writer {
    std::array<std::uint8_t, kBytes> bytes{};
    std::size_t at = 0;

    constexpr void put_8(std::size_t value) { bytes[at++] = low(value); }
    constexpr void put_16(std::size_t value) {
        put_8(value & 0xFFU);
        put_8(value >> 8U);
    }
    constexpr void put_utf16(const char* text, std::size_t length) {
        for (std::size_t i = 0; i < length; ++i) {
            put_16(static_cast<unsigned char>(text[i]));
        }
    }
};

constexpr std::array<std::uint8_t, kMicrosoftBytes> microsoft_set() {
    constexpr std::size_t kWindowsVersionHigh = 0x0603;
    constexpr std::size_t kMultiString = 7;
    Writer<kMicrosoftBytes> out;
    out.put_16(kMicrosoftHeaderBytes);
    out.put_16(0);  // set header
    out.put_16(0);
    out.put_16(kWindowsVersionHigh);
    out.put_16(kMicrosoftBytes);
    out.put_16(kMicrosoftCompatibleBytes);
    out.put_16(3);  // compatible identifier
    for (const char c : {'W', 'I', 'N', 'U', 'S', 'B'}) {
        out.put_8(static_cast<unsigned char>(c));
    }
    out.at += 10;
    out.put_16(kMicrosoftPropertyBytes);
    out.put_16(4);  // registry property
    out.put_16(kMultiString);
    out.put_16(2 * sizeof kPropertyName);
    out.put_utf16(kPropertyName, sizeof kPropertyName);
    out.put_16(2 * sizeof kPropertyData);
    out.put_utf16(kPropertyData, sizeof kPropertyData);
    return out.bytes;
}
}  // namespace detail

inline constexpr std::array<std::uint8_t, kMicrosoftBytes> kMicrosoftSet = detail::microsoft_set();

inline constexpr std::array<std::uint8_t, 33> kBos{5,
                                                   kBosDescriptor,
                                                   33,
                                                   0,
                                                   1,  //
                                                   28,
                                                   kCapabilityDescriptor,
                                                   kPlatformCapability,
                                                   0,  // UUID of the Microsoft platform capability
                                                   0xDF,
                                                   0x60,
                                                   0xDD,
                                                   0xD8,
                                                   0x89,
                                                   0x45,
                                                   0xC7,
                                                   0x4C,
                                                   0x9C,
                                                   0xD2,
                                                   0x65,
                                                   0x9D,
                                                   0x9E,
                                                   0x64,
                                                   0x8A,
                                                   0x9F,  // end of the UUID
                                                   0x00,
                                                   0x00,
                                                   0x03,
                                                   0x06,
                                                   low(kMicrosoftBytes),
                                                   high(kMicrosoftBytes),
                                                   kMicrosoftRequest,
                                                   0};

/// Strings, written on request: 0 languages (US English), 1 manufacturer, 2 product, 3 serial number in 16 hexadecimal digits.
/// Empty: no such string.
using StringBuffer = std::array<std::uint8_t, 2 + 2 * 16>;
std::span<const std::uint8_t> string_descriptor(std::uint8_t index, std::uint64_t serial, StringBuffer& buffer);

}  // namespace tricoil::stm32g4::usb
