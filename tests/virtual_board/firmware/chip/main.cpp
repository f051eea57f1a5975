// Test image: follows the sequences of the vendor's drivers on peripherals that the tracker does not use, or uses otherwise.
#include "tests/virtual_board/firmware/chip/chip.hpp"

namespace tricoil::test {

[[gnu::section(".mailbox")]] Mailbox mailbox;
volatile Word ticks;
volatile Word received;
volatile Word idle;

void note(Word value) {
    if (mailbox.count < kResults) {
        mailbox.results[mailbox.count] = value;
        mailbox.count = mailbox.count + 1;
    }
}

}  // namespace tricoil::test

using namespace tricoil::test;

namespace {

ChipJob job() { return static_cast<ChipJob>(mailbox.job); }
constexpr Word kUsart2 = 0x40004400;
constexpr Word kAdc1 = 0x50000000;

void run() {
    static constexpr void (*kJobs[])() = {clocks,        serial_fifo,  serial_dma,     can_queue,      can_loop,
                                          adc_interrupt, adc_sequence, flash_bank,     option_bytes,   watchdog,
                                          button,        tick,         dma_channels,   timers,         stop,
                                          standby,       units,        dac_software,   flash_error,    bit_band,
                                          code_in_ram,   units_off,    divide_by_zero, read_unaligned, flash_running};
    kJobs[static_cast<Word>(job())]();
}

}  // namespace

extern "C" {
extern Word bss_begin, bss_end, stack_top;

void on_interrupt() {
    Word number;
    asm volatile("mrs %0, ipsr" : "=r"(number));
    switch (number - 16) {
        case 4:
            ticks = ticks + 1;
            at(kFlash + 0x10) = 3;  // EOP, OPERR
            break;
        case 12:
            ticks = ticks + 1;
            at(kDma1 + 4) = 1U << 4U;
            break;
        case 18:
            received = at(kAdc1 + 0x40);  // also clears EOC
            ticks = ticks + 1;
            break;
        case 38:
            at(kUsart2 + 0x20) = 1U << 4U;
            idle = 1;
            break;
        case 40:
            byte_at(kGpioC + 0x15) = 0;  // a port accepts bytes
            at(0x40010414) = 1U << 13U;
            ticks = ticks + 1;
            break;
        case 56:
            ticks = ticks + 1;
            at(kDma2 + 4) = 1;
            break;
        case 91:
            on_lpuart();
            break;
        default:
            on_timer();
    }
    fence();
}
void on_tick() { ticks = ticks + 1; }

[[gnu::naked]] void reset_handler() { asm volatile("bl start"); }
[[gnu::used]] void start() {
    for (Word* word = &bss_begin; word != &bss_end; ++word) {
        *word = 0;
    }
    mailbox.boots = mailbox.boots + 1;
    run();
    mailbox.done = 1;
    for (;;) {
        sleep();
    }
}

struct Vectors {
    Word* stack;
    void (*handlers[15])();
    void (*interrupts[102])();
};
#define FOUR(x) x, x, x, x
#define TWENTY(x) FOUR(x), FOUR(x), FOUR(x), FOUR(x), FOUR(x)
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors = {
    &stack_top,
    {reset_handler, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
     nullptr, on_tick},
    {TWENTY(on_interrupt), TWENTY(on_interrupt), TWENTY(on_interrupt), TWENTY(on_interrupt), TWENTY(on_interrupt), on_interrupt,
     on_interrupt},
};
}
