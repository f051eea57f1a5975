// Register access and start-up shared by the test images.
#pragma once

#include "tests/virtual_board/firmware/mailbox.hpp"

namespace tricoil::test {

using Word = std::uint32_t;

inline volatile Word& at(Word address) { return *reinterpret_cast<volatile Word*>(address); }
inline volatile std::uint8_t& byte_at(Word address) { return *reinterpret_cast<volatile std::uint8_t*>(address); }
inline void set(Word address, Word bits) { at(address) = at(address) | bits; }
inline void clear(Word address, Word bits) { at(address) = at(address) & ~bits; }
inline void modify(Word address, Word mask, Word value) { at(address) = (at(address) & ~mask) | value; }
inline void wait_for(Word address, Word mask, Word value) {
    while ((at(address) & mask) != value) {
    }
}
inline void fence() { asm volatile("dsb\n isb" : : : "memory"); }
inline void sleep() { asm volatile("wfi" : : : "memory"); }

inline void enable_interrupt(Word interrupt) { at(0xE000E100 + 4 * (interrupt / 32)) = 1U << interrupt % 32; }

constexpr Word kRcc = 0x40021000;
constexpr Word kAhb1 = kRcc + 0x48;
constexpr Word kAhb2 = kRcc + 0x4C;
constexpr Word kApb1 = kRcc + 0x58;
constexpr Word kApb1More = kRcc + 0x5C;
constexpr Word kApb2 = kRcc + 0x60;
constexpr Word kCcipr = kRcc + 0x88;
constexpr Word kPwr = 0x40007000;
constexpr Word kFlash = 0x40022000;
constexpr Word kGpioA = 0x48000000;
constexpr Word kGpioB = 0x48000400;
constexpr Word kGpioC = 0x48000800;
constexpr Word kDma1 = 0x40020000;
constexpr Word kDma2 = 0x40020400;
constexpr Word kDmamux = 0x40020800;

/// Alternate function of a pin of a port.
inline void alternate(Word port, Word pin, Word function) {
    modify(port + 0x20 + 4 * (pin / 8), 0xFU << 4 * (pin % 8), function << 4 * (pin % 8));
    modify(port, 3U << 2 * pin, 2U << 2 * pin);
}

}  // namespace tricoil::test
