// Register offsets, bits and times of the converters (RM0440 section 21, DS12288).
#pragma once

#include <array>
#include <cstdint>

#include "sim/virtual_board/machine/time.hpp"

namespace tricoil::virtual_board::adc {

constexpr std::uint32_t kIsr = 0x00;
constexpr std::uint32_t kIer = 0x04;
constexpr std::uint32_t kCr = 0x08;
constexpr std::uint32_t kCfgr = 0x0C;
constexpr std::uint32_t kCfgr2 = 0x10;
constexpr std::uint32_t kSmpr1 = 0x14;
constexpr std::uint32_t kSmpr2 = 0x18;
constexpr std::uint32_t kTr1 = 0x20;
constexpr std::uint32_t kSqr1 = 0x30;
constexpr std::uint32_t kDr = 0x40;
constexpr std::uint32_t kJsqr = 0x4C;
constexpr std::uint32_t kOffset1 = 0x60;
constexpr std::uint32_t kJdr1 = 0x80;
constexpr std::uint32_t kCalibration = 0xB4;
constexpr std::uint32_t kGain = 0xC0;

constexpr unsigned kReady = 0;
constexpr unsigned kEndOfSampling = 1;
constexpr unsigned kEndOfConversion = 2;
constexpr unsigned kEndOfSequence = 3;
constexpr unsigned kOverrun = 4;
constexpr unsigned kEndOfInjectedConversion = 5;
constexpr unsigned kEndOfInjectedSequence = 6;
constexpr unsigned kWatchdog1 = 7;

constexpr unsigned kEnable = 0;
constexpr unsigned kDisable = 1;
constexpr unsigned kStart = 2;
constexpr unsigned kStartInjected = 3;
constexpr unsigned kStop = 4;
constexpr unsigned kStopInjected = 5;
constexpr unsigned kRegulator = 28;
constexpr unsigned kDeepPowerDown = 29;
constexpr unsigned kCalibrate = 31;

// Bits of CFGR and CFGR2.
constexpr unsigned kDma = 0;
constexpr unsigned kDmaEndless = 1;
constexpr unsigned kOverwrite = 12;
constexpr unsigned kContinuous = 13;
constexpr unsigned kAlignLeft = 15;
constexpr unsigned kSingleInjected = 20;  // JDISCEN
constexpr unsigned kQueueOff = 31;        // JQDIS
constexpr unsigned kAutomatic = 25;       // JAUTO
constexpr unsigned kOversampleRegular = 0;
constexpr unsigned kOversampleInjected = 1;
constexpr unsigned kTriggerEach = 9;
constexpr unsigned kResumed = 10;  // ROVSM
constexpr unsigned kGainOn = 16;

constexpr double kReadyS = 1e-6;            // DS12288, stabilisation time after power-up
constexpr double kRegulatorStartS = 20e-6;  // DS12288, start-up time of the converter's voltage regulator
constexpr Ticks kCalibrationCycles = 116;
constexpr double kMaxHz = 60e6;  // DS12288, one converter at 12 bits
// Sampling times of the SMPR codes, and conversion times of the RES codes, in half cycles.
constexpr std::array<int, 8> kSampling2{5, 13, 25, 49, 95, 185, 495, 1281};
constexpr std::array<int, 4> kConverting2{25, 21, 17, 13};
constexpr std::array<unsigned, 4> kLeftShifts{4, 6, 8, 2};
constexpr double kMaxIdleS = 1e-3;  // ES0430 2.7.9

}  // namespace tricoil::virtual_board::adc
