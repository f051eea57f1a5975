// From the oscillator that runs at reset to full speed.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"
#include "drivers/stm32g4/registers/flash.hpp"
#include "drivers/stm32g4/registers/pwr.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"

namespace tricoil::stm32g4 {

constexpr std::uint32_t kFullSpeedHz = 170'000'000;
constexpr std::uint32_t kInternalOscillatorHz = 16'000'000;

/// What the core, and all buses, run from.
enum class CoreClock : std::uint8_t {
    crystal,       // 170 MHz, exact
    internal,      // 170 MHz within a percent: the crystal did not start
    unmultiplied,  // 16 MHz: the PLL did not lock either
};

constexpr std::uint32_t hertz_of(CoreClock clock) {
    return clock == CoreClock::unmultiplied ? kInternalOscillatorHz : kFullSpeedHz;
}

/// Once after reset, from the internal oscillator: 170 MHz on all buses, from a 24 MHz crystal if that starts. Then the crystal
/// is watched: should it stop, the NMI comes and CIFR_CSSF is set. Waits some milliseconds at most.
CoreClock start_core_clock(RccRegisters& rcc, PwrRegisters& pwr, FlashRegisters& flash);

/// The 48 MHz oscillator that USB needs. ok; timed_out.
Status start_usb_clock(RccRegisters& rcc);

}  // namespace tricoil::stm32g4
