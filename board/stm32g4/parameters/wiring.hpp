// Types for the constants in a board's pins.hpp.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4_board {

/// Port letter and number. Alternate functions are those of the data sheet.
struct PinName {
    char port;
    std::uint8_t number;
};

/// Request of the DMA multiplexer (RM0440 table 91) and its channel of DMA1, 1-7.
struct DmaRoute {
    std::uint8_t channel;
    std::uint8_t request;
};

/// Converter (1, 3, 4 or 5), its input channel, and the DMA channel that stores its results.
struct AdcInput {
    std::uint8_t adc;
    std::uint8_t channel;
    DmaRoute dma;
};

/// Interrupt number (RM0440 table 97) and priority; 0 is the highest, 15 the lowest.
struct InterruptPlan {
    std::uint8_t number;
    std::uint8_t priority;
};

}  // namespace tricoil::stm32g4_board
