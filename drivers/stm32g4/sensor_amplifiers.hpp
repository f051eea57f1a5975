// Gain of the sensor channels: three on-chip op-amps.
#pragma once

#include <array>
#include <cstdint>

#include "core/signal/excitation.hpp"
#include "drivers/stm32g4/registers/opamp.hpp"

namespace tricoil::stm32g4 {

/// Non-inverting amplifiers. The feedback ladder ends at a capacitor on VINM0, so that the carriers are amplified and the bias
/// voltage is not. Step 0 is a follower, step n multiplies by 2^n. Any context.
class SensorAmplifiers {
public:
    static constexpr std::uint8_t kSteps = 7;
    static constexpr float kLadder_s = 10e-3F;  // 1 uF, and 10 kOhm of the ladder at its end (DS12288), at every gain

    static constexpr float gain_of(std::uint8_t step) { return static_cast<float>(1U << step); }

    /// `numbers`: op-amps (1-6) of sensor coils 1-3. Each has its signal on VINP0 and an on-chip connection from its output to an
    /// ADC.
    SensorAmplifiers(OpampRegisters& registers, std::array<std::uint8_t, kSensorCoils> numbers)
        : registers_(registers), numbers_(numbers) {}

    /// Input signal: the sensor coils, or the on-chip DAC of each op-amp.
    enum class Input : std::uint8_t { coils, inside };

    /// Sets all three op-amps and switches them on. `step` < kSteps.
    void set(std::uint8_t step, Input input) const {
        for (const std::uint8_t number : numbers_) {
            registers_.CSR[number - 1] = opamp::CSR_OPAEN | opamp::CSR_OPAHSM | opamp::CSR_OPAINTOEN |
                                         (input == Input::inside ? opamp::CSR_VP_SEL_dac : 0U) | feedback(step);
        }
    }

private:
    static constexpr std::uint32_t feedback(std::uint8_t step) {
        return step == 0
                   ? opamp::CSR_VM_SEL_follower
                   : opamp::CSR_VM_SEL_ladder | opamp::CSR_PGA_GAIN_ladder_to_VINM0 | (step - 1U) << opamp::CSR_PGA_GAIN_Pos;
    }

    OpampRegisters& registers_;
    std::array<std::uint8_t, kSensorCoils> numbers_;
};

}  // namespace tricoil::stm32g4
