// General-purpose I/O (RM0440, chapter GPIO).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct GpioRegisters {
    volatile std::uint32_t MODER;
    volatile std::uint32_t OTYPER;
    volatile std::uint32_t OSPEEDR;
    volatile std::uint32_t PUPDR;
    volatile std::uint32_t IDR;
    volatile std::uint32_t ODR;
    volatile std::uint32_t BSRR;
    volatile std::uint32_t LCKR;
    volatile std::uint32_t AFR[2];
    volatile std::uint32_t BRR;
};
static_assert(offsetof(GpioRegisters, BSRR) == 0x18);
static_assert(offsetof(GpioRegisters, BRR) == 0x28);

constexpr std::uintptr_t kGpioABase = 0x4800'0000;
constexpr std::uintptr_t kGpioPortBytes = 0x400;  // distance between two ports

namespace gpio {
constexpr std::uint32_t MODER_input = 0;
constexpr std::uint32_t MODER_output = 1;
constexpr std::uint32_t MODER_alternate = 2;
constexpr std::uint32_t PUPDR_pull_up = 1;
constexpr std::uint32_t PUPDR_pull_down = 2;
constexpr std::uint32_t OSPEEDR_high = 2;
}  // namespace gpio

}  // namespace tricoil::stm32g4
