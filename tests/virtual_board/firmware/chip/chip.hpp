// Test image `chip`: what its parts share.
#pragma once

#include "tests/virtual_board/firmware/chip_jobs.hpp"
#include "tests/virtual_board/firmware/registers.hpp"

namespace tricoil::test {

extern Mailbox mailbox;
extern volatile Word ticks;     // interrupts, of the job's main peripheral
extern volatile Word received;  // bytes or codes
extern volatile Word idle;      // interrupts of an idle line

/// Appends a result to the mailbox.
void note(Word value);

/// Dividers of the PLL from 16 MHz.
struct Pll {
    Word m, n, r;
    Word hz;
    bool boost;
    Word wait_states;
};
/// Runs from the PLL: voltage, PLL with its outputs enabled after PLLON, prescaler, wait states, switch, prescaler: the order of
/// the vendor's driver.
void run_at(const Pll& pll);

/// Registers of channel n, from 0, of a DMA controller.
inline Word channel(Word dma, Word n) { return dma + 8 + 20 * n; }
/// Sets up and enables a channel.
void start_channel(Word dma, Word n, Word request, Word peripheral, const volatile void* memory, Word count, Word control);

// Jobs.
void clocks();
void serial_fifo();
void serial_dma();
void can_queue();
void can_loop();
void adc_interrupt();
void adc_sequence();
void flash_bank();
void option_bytes();
void watchdog();
void button();
void tick();
void dma_channels();
void timers();
void stop();
void standby();
void units();
void dac_software();
void flash_error();
void flash_running();
void bit_band();
void code_in_ram();
void units_off();
void divide_by_zero();
void read_unaligned();

// Interrupts that need more than an acknowledgement.
void on_lpuart();
void on_timer();

}  // namespace tricoil::test
