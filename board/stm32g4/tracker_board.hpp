// All drivers of a tracker board, connected according to pins.hpp: the hardware of the firmware application.
#pragma once

#include <array>

#include "board/app/device_parts.hpp"
#include "board/stm32g4/image_bank.hpp"
#include "drivers/stm32g4/acquisition.hpp"
#include "drivers/stm32g4/clocks.hpp"
#include "drivers/stm32g4/fdcan/fdcan_port.hpp"
#include "drivers/stm32g4/flash_storage.hpp"
#include "drivers/stm32g4/independent_watchdog.hpp"
#include "drivers/stm32g4/lines.hpp"
#include "drivers/stm32g4/processor.hpp"
#include "drivers/stm32g4/supply_monitor.hpp"
#include "drivers/stm32g4/timer_clock.hpp"
#include "drivers/stm32g4/usart/usart_port.hpp"
#include "drivers/stm32g4/usb/usb_port.hpp"

namespace tricoil::stm32g4_board {

/// Exactly one object, which is never destroyed. Construction switches nothing on.
struct TrackerBoard {
    explicit TrackerBoard(stm32g4::CoreClock core);

    /// Starts peripheral clocks, pins (coils off), interrupts and links. Failures appear in processor.faults() or at first use.
    void begin();

    [[nodiscard]] app::DeviceHardware hardware();

    stm32g4::CoreClock core;
    stm32g4::TimerClock clock;
    stm32g4::Processor processor;
    stm32g4::IndependentWatchdog watchdog;
    stm32g4::FlashStorage storage;
    FlashImageBank image;
    stm32g4::HeartbeatLine heartbeat;
    stm32g4::StatusLed status_led;
    stm32g4::ButtonLine button;
    static constexpr std::size_t kTableValues = 2600;     // two bands: 1,200 + 800 + 600
    static constexpr std::size_t kTestTableValues = 480;  // the first mode
    std::array<std::uint16_t, kTableValues> carrier_memory{};
    std::array<std::uint16_t, kTestTableValues> test_carrier_memory{};
    stm32g4::CarrierPlayer carriers;
    stm32g4::CarrierPlayer test_carriers;
    stm32g4::Converters converters;
    stm32g4::SupplyMonitor monitor;
    stm32g4::Acquisition acquisition;
    stm32g4::UsartPort serial;
    stm32g4::FdcanPort can;
    stm32g4::UsbPort usb;
    std::array<hal::MessagePort*, 3> ports{&serial, &can, &usb};
};

/// Serial number from the processor's unique number (RM0440, "Unique device ID"): die position on the wafer, and lot.
[[nodiscard]] std::uint64_t unique_number();

}  // namespace tricoil::stm32g4_board
