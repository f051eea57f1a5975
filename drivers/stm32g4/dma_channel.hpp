// One channel of DMA1 between a converter's data register and a circular buffer.
#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/stm32g4/registers/dma.hpp"

namespace tricoil::stm32g4 {

class DmaChannel {
public:
    /// `number` 1-8; `request`: number at the request multiplexer.
    DmaChannel(DmaRegisters& dma, DmamuxRegisters& multiplexer, std::uint8_t number, std::uint8_t request)
        : dma_(dma), multiplexer_(multiplexer), number_(number), request_(request) {}

    enum class Direction : std::uint8_t { from_converter, to_converter };

    /// Moves half-words continuously. `interrupts`: at the middle and at the end of the buffer.
    void start(Direction direction, volatile std::uint32_t& data_register, std::uint16_t* buffer, std::size_t count,
               bool interrupts = false) const {
        stop();
        multiplexer_.CCR[number_ - 1] = request_;
        channel().CPAR = address_of(&data_register);
        channel().CMAR = address_of(buffer);
        channel().CNDTR = static_cast<std::uint32_t>(count);
        const bool out = direction == Direction::to_converter;
        // The DAC's data register accepts word writes only; the ADC's is read as half-words.
        channel().CCR = dma::CCR_EN | dma::CCR_CIRC | dma::CCR_MINC | dma::CCR_MSIZE_16 | dma::CCR_PL_very_high |
                        (out ? dma::CCR_DIR_from_memory | dma::CCR_PSIZE_32 : dma::CCR_PSIZE_16) |
                        (interrupts ? dma::CCR_HTIE | dma::CCR_TCIE | dma::CCR_TEIE : 0);
    }

    void stop() const {
        channel().CCR = 0;
        dma_.IFCR = dma::ISR_GIF << flag_shift();
    }

    /// Returns and clears the flags: dma::ISR_TCIF, ISR_HTIF, ISR_TEIF.
    [[nodiscard]] std::uint32_t take_flags() const {
        const std::uint32_t flags = dma_.ISR >> flag_shift() & (dma::ISR_TCIF | dma::ISR_HTIF | dma::ISR_TEIF);
        dma_.IFCR = flags << flag_shift();
        return flags;
    }

private:
    [[nodiscard]] DmaChannelRegisters& channel() const { return dma_.channel[number_ - 1]; }
    [[nodiscard]] unsigned flag_shift() const { return dma::kFlagsPerChannel * (number_ - 1U); }
    static std::uint32_t address_of(const volatile void* what) {
        return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(what));
    }

    DmaRegisters& dma_;
    DmamuxRegisters& multiplexer_;
    std::uint8_t number_;
    std::uint8_t request_;
};

}  // namespace tricoil::stm32g4
