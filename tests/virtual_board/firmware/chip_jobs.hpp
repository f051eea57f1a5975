// Jobs of the image `chip`: sequences of register accesses as in the vendor's drivers. The mailbox is that of mailbox.hpp; its
// job number is one of these.
#pragma once

#include <cstdint>

namespace tricoil::test {

enum class ChipJob : std::uint32_t {
    clocks,          // 150 MHz and other frequencies; records the system clock source and a millisecond of cycles for each
    serial_fifo,     // LPUART1, FIFO threshold interrupts: sends back what it receives, until 16 bytes
    serial_dma,      // USART2, DMA both ways, idle interrupt
    can_queue,       // FDCAN1, queue mode with cancellation
    can_loop,        // FDCAN1 to FDCAN3, loop-back
    adc_interrupt,   // ADC1, software trigger, end-of-conversion interrupt
    adc_sequence,    // ADC1 and DMA2, continuous sequence of two channels
    flash_bank,      // mass erase of bank 2 and a double-word, end-of-operation interrupt
    option_bytes,    // reads them
    watchdog,        // IWDG with window, until the reset
    button,          // EXTI line 13, both edges
    tick,            // SysTick from HCLK/8
    dma_channels,    // memory to memory on every channel of both controllers
    timers,          // update interrupts of every timer, compare interrupts, one pulse
    stop,            // Stop mode until the button
    standby,         // Standby until the button
    units,           // CRC, DBGMCU
    dac_software,    // DAC1, software trigger
    flash_error,     // error interrupt of the flash
    bit_band,        // single bits of RAM and of a peripheral
    code_in_ram,     // copied, run, overwritten, run again
    units_off,       // settings that the chip accepts while they have no effect
    divide_by_zero,  // without and with CCR.DIV_0_TRP
    read_unaligned,  // without and with CCR.UNALIGN_TRP
    flash_running,   // erases and programs the bank that runs; records cycles and words
};

}  // namespace tricoil::test
