// USB identifier of tracker boards, for image and host: option TRICOIL_USB_ID of the build.
#pragma once

#include <cstdint>

namespace tricoil::protocol {

#ifdef TRICOIL_USB_VENDOR
constexpr std::uint16_t kUsbVendor = TRICOIL_USB_VENDOR;
constexpr std::uint16_t kUsbProduct = TRICOIL_USB_PRODUCT;
#else
constexpr std::uint16_t kUsbVendor = 0x1209;  // with this product, an identifier of pid.codes for tests
constexpr std::uint16_t kUsbProduct = 0x0001;
#endif

}  // namespace tricoil::protocol
