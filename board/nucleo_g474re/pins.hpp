// Assignment of pins, converters, timers, DMA channels and interrupts of the tracker board. HARDWARE.md has the wiring table.
// Sources: DS12288 (pins), RM0440 (everything else), UM2505 (Nucleo).
#pragma once

#include <array>

#include "board/stm32g4/parameters/wiring.hpp"

namespace tricoil::nucleo_g474re {

using stm32g4_board::AdcInput;
using stm32g4_board::DmaRoute;
using stm32g4_board::InterruptPlan;
using stm32g4_board::PinName;

// Carriers of the three source coils. PA5 also feeds the green user LED: open solder bridge SB6.
constexpr PinName kCarrier1{'A', 4};  // DAC1_OUT1
constexpr PinName kCarrier2{'A', 5};  // DAC1_OUT2
constexpr PinName kCarrier3{'A', 6};  // DAC2_OUT1

// Enables of the coil amplifiers: high is on. 4.7 kOhm to ground keeps them off while the pins float during reset.
constexpr PinName kEnable1{'C', 6};
constexpr PinName kEnable2{'C', 7};
constexpr PinName kEnable3{'C', 8};
constexpr PinName kHeartbeat{'C', 9};  // one edge per block; without edges an external monostable switches the enables off

// Sensor coils are connected to op-amps as non-inverting amplifiers. Their feedback ladder ends at a capacitor on VINM0, so the
// gain applies to the carriers only and the bias has gain one. Only op-amps 3, 4 and 6 have a free VINM0.
constexpr PinName kSensor1{'B', 0};            // OPAMP3_VINP0 -> ADC3_IN13
constexpr PinName kSensor1Capacitor{'B', 2};   // OPAMP3_VINM0
constexpr PinName kSensor2{'B', 12};           // OPAMP6_VINP0 -> ADC4_IN17
constexpr PinName kSensor2Capacitor{'A', 1};   // OPAMP6_VINM0
constexpr PinName kSensor3{'B', 13};           // OPAMP4_VINP0 -> ADC5_IN5
constexpr PinName kSensor3Capacitor{'B', 10};  // OPAMP4_VINM0
constexpr PinName kReference{'A', 0};          // ADC1_IN1: coil current, always at gain one
constexpr PinName kThermistor{'C', 0};         // ADC1_IN6: heat sink, 10 kOhm to ground and 10 kOhm to AVDD
constexpr PinName kStagesCool{'C', 1};         // low: a power stage is in thermal shutdown, and all enables are off

constexpr PinName kStatusLed{'C', 10};  // high is on
constexpr PinName kButton{'C', 13};     // B1, the blue button of the Nucleo: high while it is pressed

constexpr PinName kSerialTx{'A', 2};  // USART2, to the ST-LINK's virtual serial port
constexpr PinName kSerialRx{'A', 3};
constexpr std::uint8_t kSerialFunction = 7;
constexpr PinName kCanRx{'B', 5};  // FDCAN2; not PB8, which is BOOT0
constexpr PinName kCanTx{'B', 6};
constexpr std::uint8_t kCanFunction = 9;
constexpr PinName kUsbMinus{'A', 11};  // analog; the USB peripheral controls them while it is on
constexpr PinName kUsbPlus{'A', 12};

constexpr std::uint8_t kSensor1Opamp = 3;
constexpr std::uint8_t kSensor2Opamp = 6;
constexpr std::uint8_t kSensor3Opamp = 4;

constexpr AdcInput kReferenceInput{1, 1, {1, 5}};
constexpr std::uint8_t kThermistorInput = 6;  // of ADC1
/// The DMA channel of the last input has the lowest priority, so the other transfers are complete when its interrupt ends a
/// block.
constexpr std::array<AdcInput, 3> kSensorInputs{{{3, 13, {2, 37}}, {4, 17, {3, 38}}, {5, 5, {4, 39}}}};
constexpr DmaRoute kDmaDac1Channel1{5, 6};
constexpr DmaRoute kDmaDac1Channel2{6, 7};
constexpr DmaRoute kDmaDac2Channel1{7, 41};
// During the gain measurement the carriers are connected to the op-amps inside the chip (RM0440, "OPAMP non-inverting inputs"):
// DAC3_CH1 to op-amp 6, DAC3_CH2 to op-amp 3, DAC4_CH1 to op-amp 4.
constexpr DmaRoute kDmaDac3Channel1{5, 102};
constexpr DmaRoute kDmaDac3Channel2{6, 103};
constexpr DmaRoute kDmaDac4Channel1{7, 104};

constexpr InterruptPlan kOverCurrent{18, 0};  // ADC1_2: analog watchdog of the reference
constexpr InterruptPlan kBlockEnd{14, 1};     // DMA1 channel 4
constexpr InterruptPlan kUsb{20, 4};          // USB_LP
constexpr InterruptPlan kCan{86, 4};          // FDCAN2_IT0
constexpr InterruptPlan kSerial{38, 4};       // USART2
constexpr std::uint8_t kTickPriority = 8;     // SysTick, 1 kHz: only wakes the processor

constexpr std::uintptr_t kSram2 = 0x2001'4000;  // above SRAM1
constexpr std::uintptr_t kCcmRam = 0x2001'8000;

}  // namespace tricoil::nucleo_g474re

namespace tricoil {
namespace this_board = nucleo_g474re;  // for the sources of board/stm32g4
}
