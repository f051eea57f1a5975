// Which pin, converter, timer, DMA channel and interrupt does what on the tracker board. The table in README.md says the same for
// whoever wires it; facts from DS12288 (pins), RM0440 (everything else), UM2505 (the Nucleo).
#pragma once

#include <array>

#include "board/stm32g4/wiring.hpp"

namespace tricoil::nucleo_g474re {

using stm32g4_board::AdcInput;
using stm32g4_board::DmaRoute;
using stm32g4_board::InterruptPlan;
using stm32g4_board::PinName;

// Carriers of the three source coils. PA5 also feeds the green user LED: open solder bridge SB6.
constexpr PinName kCarrier1{'A', 4};  // DAC1_OUT1
constexpr PinName kCarrier2{'A', 5};  // DAC1_OUT2
constexpr PinName kCarrier3{'A', 6};  // DAC2_OUT1

// Enables of the coils' amplifiers: high is on; 4.7 kOhm to ground keeps them off while the pins float at reset.
constexpr PinName kEnable1{'C', 6};
constexpr PinName kEnable2{'C', 7};
constexpr PinName kEnable3{'C', 8};
constexpr PinName kHeartbeat{'C', 9};  // an edge a block; without them the external monostable takes the enables away

// Sensor coils go through the op-amps as non-inverting amplifiers whose feedback ladder ends at a capacitor on VINM0: the gain is
// for the carriers only, the bias passes with gain one. Only op-amps 3, 4 and 6 have a VINM0 that nothing else needs.
constexpr PinName kSensor1{'B', 0};            // OPAMP3_VINP0 -> ADC3_IN13
constexpr PinName kSensor1Capacitor{'B', 2};   // OPAMP3_VINM0
constexpr PinName kSensor2{'B', 12};           // OPAMP6_VINP0 -> ADC4_IN17
constexpr PinName kSensor2Capacitor{'A', 1};   // OPAMP6_VINM0
constexpr PinName kSensor3{'B', 13};           // OPAMP4_VINP0 -> ADC5_IN5
constexpr PinName kSensor3Capacitor{'B', 10};  // OPAMP4_VINM0
constexpr PinName kReference{'A', 0};          // ADC1_IN1: the coils' current, always at gain one

constexpr PinName kStatusLed{'C', 10};  // high is on

constexpr PinName kSerialTx{'A', 2};  // USART2, to the ST-LINK's virtual serial port
constexpr PinName kSerialRx{'A', 3};
constexpr std::uint8_t kSerialFunction = 7;
constexpr PinName kCanRx{'B', 5};  // FDCAN2; not PB8, which is BOOT0
constexpr PinName kCanTx{'B', 6};
constexpr std::uint8_t kCanFunction = 9;
constexpr PinName kUsbMinus{'A', 11};  // analog; the USB peripheral takes them over when it is on
constexpr PinName kUsbPlus{'A', 12};

constexpr std::uint8_t kSensor1Opamp = 3;
constexpr std::uint8_t kSensor2Opamp = 6;
constexpr std::uint8_t kSensor3Opamp = 4;

constexpr AdcInput kReferenceInput{1, 1, {1, 5}};
/// The last one's DMA channel is the last in priority: when it is through, so are the others; its interrupt ends a block.
constexpr std::array<AdcInput, 3> kSensorInputs{{{3, 13, {2, 37}}, {4, 17, {3, 38}}, {5, 5, {4, 39}}}};
constexpr DmaRoute kDmaDac1Channel1{5, 6};
constexpr DmaRoute kDmaDac1Channel2{6, 7};
constexpr DmaRoute kDmaDac2Channel1{7, 41};
// While the gain is measured the carriers go to the op-amps, within the chip (RM0440, "OPAMP non-inverting inputs"): DAC3_CH1 to
// op-amp 6, DAC3_CH2 to op-amp 3, DAC4_CH1 to op-amp 4.
constexpr DmaRoute kDmaDac3Channel1{5, 102};
constexpr DmaRoute kDmaDac3Channel2{6, 103};
constexpr DmaRoute kDmaDac4Channel1{7, 104};

constexpr InterruptPlan kOverCurrent{18, 0};  // ADC1_2: analog watchdog of the reference
constexpr InterruptPlan kBlockEnd{14, 1};     // DMA1 channel 4
constexpr InterruptPlan kUsb{20, 4};          // USB_LP
constexpr InterruptPlan kCan{86, 4};          // FDCAN2_IT0
constexpr InterruptPlan kSerial{38, 4};       // USART2
constexpr std::uint8_t kTickPriority = 8;     // SysTick, 1 kHz: only ends a wait

}  // namespace tricoil::nucleo_g474re

namespace tricoil {
namespace this_board = nucleo_g474re;  // for the sources of board/stm32g4
}
