// Bit timing of CAN: divides a clock into time quanta.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tricoil::stm32g4 {

/// One bit in time quanta: 1 + segment_1 + segment_2. prescaler = 0: no timing exists.
struct BitTiming {
    std::uint32_t prescaler = 0;  // clock cycles per quantum
    std::uint32_t segment_1 = 0;  // before the sample point
    std::uint32_t segment_2 = 0;  // after the sample point
    std::uint32_t jump = 0;       // largest shift of one resynchronisation
};

/// Largest values of the registers of one phase.
struct BitTimingLimits {
    std::uint32_t prescaler;
    std::uint32_t segment_1;
    std::uint32_t segment_2;
    std::uint32_t jump;
};
constexpr BitTimingLimits kNominalLimits{512, 256, 128, 128};
/// With transmitter delay compensation the prescaler is at most 2.
constexpr BitTimingLimits kDataLimits{2, 32, 16, 16};

/// Exact timing with the shortest quanta. The sample point is as near to 75 % as possible, as in Linux above 800 kbit/s.
constexpr BitTiming bit_timing(std::uint32_t clock_hz, std::uint32_t bit_rate, const BitTimingLimits& limits) {
    if (bit_rate == 0 || clock_hz % bit_rate != 0) {
        return {};
    }
    const std::uint32_t cycles = clock_hz / bit_rate;
    for (std::uint32_t prescaler = 1; prescaler <= limits.prescaler; ++prescaler) {
        const std::uint32_t quanta = cycles / prescaler;
        if (cycles % prescaler != 0 || quanta < 8) {
            continue;
        }
        const std::uint32_t sample_point = (3 * quanta + 2) / 4;
        const BitTiming timing{prescaler, sample_point - 1, quanta - sample_point, std::min(quanta - sample_point, limits.jump)};
        if (timing.segment_1 <= limits.segment_1 && timing.segment_2 <= limits.segment_2) {
            return timing;
        }
    }
    return {};
}

}  // namespace tricoil::stm32g4
