// Starts the core clock: from the reset oscillator to full speed.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"
#include "drivers/stm32g4/registers/flash.hpp"
#include "drivers/stm32g4/registers/pwr.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"

namespace tricoil::stm32g4 {

constexpr std::uint32_t kFullSpeedHz = 170'000'000;
constexpr std::uint32_t kInternalOscillatorHz = 16'000'000;

/// Source and frequency of the core clock and of all bus clocks.
enum class CoreClock : std::uint8_t {
    crystal,       // 170 MHz, exact
    internal,      // 170 MHz within one percent: the crystal did not start
    unmultiplied,  // 16 MHz: the PLL did not lock
};

constexpr std::uint32_t hertz_of(CoreClock clock) {
    return clock == CoreClock::unmultiplied ? kInternalOscillatorHz : kFullSpeedHz;
}

/// Call once after reset: 170 MHz on all buses, from a 24 MHz crystal if it starts, otherwise from the internal oscillator. The
/// clock security system then watches the crystal: if it stops, the NMI is raised and CIFR_CSSF is set. Takes about 2 ms with a
/// crystal, and more than 10 ms if the crystal does not start.
CoreClock start_core_clock(RccRegisters& rcc, PwrRegisters& pwr, FlashRegisters& flash);

/// Starts the 48 MHz oscillator for USB. ok; timed_out.
Status start_usb_clock(RccRegisters& rcc);

}  // namespace tricoil::stm32g4
