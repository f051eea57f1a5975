// Steps of drive and gain, from the nearest sensor to the farthest.
#pragma once

#include <cstdint>

#include "drivers/stm32g4/sensor_amplifiers.hpp"

namespace tricoil::stm32g4 {

/// The first steps have gain 1 and 1/32, 1/16, ... 1/2 of the drive; the others have full drive.
constexpr std::uint8_t kDriveSteps = 5;
constexpr std::uint8_t kRangeSteps = kDriveSteps + SensorAmplifiers::kSteps;

constexpr float drive_of(std::uint8_t step) {
    return step < kDriveSteps ? 1 / static_cast<float>(1U << (kDriveSteps - step)) : 1.0F;
}
/// Step of the amplifiers.
constexpr std::uint8_t amplifier_step(std::uint8_t step) {
    return static_cast<std::uint8_t>(step < kDriveSteps ? 0 : step - kDriveSteps);
}

}  // namespace tricoil::stm32g4
