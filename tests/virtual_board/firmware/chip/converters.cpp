// Test image: converters and timers.
#include "tests/virtual_board/firmware/chip/chip.hpp"

namespace tricoil::test {

namespace {

constexpr Word kAdc1 = 0x50000000;

void set_up_adc() {
    set(kAhb2, 1U << 13U);
    modify(kAdc1 + 0x308, 3U << 16U, 3U << 16U);  // synchronous, divided by 4
    set(kAdc1 + 0x308, 1U << 22U);                // reference voltage
    clear(kAdc1 + 0x08, 1U << 29U);
    set(kAdc1 + 0x08, 1U << 28U);
    for (Word n = 0; n < 400; n = n + 1) {
        asm volatile("nop");
    }
    set(kAdc1 + 0x08, 1U << 31U);
    wait_for(kAdc1 + 0x08, 1U << 31U, 0);
    at(kAdc1) = 1;
    set(kAdc1 + 0x08, 1);
    wait_for(kAdc1, 1, 1);
    at(kAdc1) = 1;
    at(kAdc1 + 0x18) = 5U << 24U;  // channel 18: 92.5 cycles
}

}  // namespace

void adc_interrupt() {
    set_up_adc();
    at(kAdc1 + 0x30) = 18U << 6U;
    at(kAdc1 + 0x04) = 1U << 2U;
    enable_interrupt(18);
    for (Word n = 1; n <= 3; ++n) {
        modify(kAdc1 + 0x0C, 3U << 3U, n == 3 ? 2U << 3U : 0);  // the last one with 8 bits
        set(kAdc1 + 0x08, 1U << 2U);
        while (ticks < n) {
            sleep();
        }
        note(received);
        note(at(kAdc1 + 0x08) & 4U);
    }
}

void adc_sequence() {
    static volatile std::uint16_t codes[8];
    set(kAhb1, 7);
    set_up_adc();
    at(kAdc1 + 0x30) = 1U | 18U << 6U | 1U << 12U;
    at(kAdc1 + 0x0C) = 1U << 31U | 1U << 13U | 1U << 12U | 1U;
    start_channel(kDma2, 0, 5, kAdc1 + 0x40, codes, 8, 1U << 7U | 1U << 8U | 1U << 10U | 1U << 1U);
    enable_interrupt(56);
    set(kAdc1 + 0x08, 1U << 2U);
    while (ticks == 0) {
        sleep();
    }
    note(codes[6]);
    note(codes[7]);
    note(at(kAdc1) >> 4U & 1U);  // no overrun after the last transfer
}

/// DAC1, channel 1, software trigger: the vendor's driver also writes the trigger of the sawtooth, which is off.
void dac_software() {
    constexpr Word kDac = 0x50000800;
    set(kAhb2, 1U << 16U);
    clear(kDac, 1U << 14U);
    at(kDac + 0x3C) = 0;
    modify(kDac, 0x3EU, 1U << 1U);
    clear(kDac, 3U << 6U);
    modify(kDac + 0x60, 0xF0FU, 7U | 3U << 8U);  // STMODR
    set(kDac, 1);
    at(kDac + 0x08) = 1234;
    note(at(kDac + 0x2C));
    set(kDac + 0x04, 1);
    note(at(kDac + 0x2C));
    note(at(kDac + 0x60));
}

namespace {

volatile Word updates;
constexpr Word kTimers[] = {0x40012C00, 0x40000000, 0x40000400, 0x40000800, 0x40000C00, 0x40001000,
                            0x40001400, 0x40013400, 0x40014000, 0x40014400, 0x40014800, 0x40015000};
constexpr Word kTimerLines[] = {25, 28, 29, 30, 50, 54, 55, 44, 24, 25, 26, 78};

}  // namespace

void on_timer() {
    for (const Word timer : kTimers) {
        if ((at(timer + 0x0C) & at(timer + 0x10) & 1U) != 0) {
            at(timer + 0x10) = ~1U;
            updates = updates + 1;
        }
    }
    fence();
}

void timers() {
    set(kApb1, 0x3F);
    set(kApb2, 1U << 11U | 1U << 13U | 7U << 16U | 1U << 20U);
    for (Word n = 0; n < 12; ++n) {
        const Word timer = kTimers[n];
        at(timer + 0x28) = 15;
        at(timer + 0x2C) = 999;
        at(timer) = 4;
        at(timer + 0x14) = 1;
        at(timer + 0x0C) = 1;
        enable_interrupt(kTimerLines[n]);
        set(timer, 1);
        const Word before = updates;
        while (updates < before + 2) {
            sleep();
        }
        at(timer) = 0;
        at(timer + 0x0C) = 0;
        note(updates - before);
    }
    const Word timer = 0x40000400;  // TIM3, preload, compare, one pulse
    at(timer + 0x2C) = 99;
    at(timer + 0x34) = 40;
    at(timer) = 1U << 7U | 1U << 3U;
    at(timer + 0x14) = 1;
    at(timer + 0x10) = 0;
    set(timer, 1);
    at(timer + 0x2C) = 199;
    while ((at(timer + 0x10) & 2U) == 0) {
    }
    note(at(timer + 0x24));
    while ((at(timer + 0x10) & 1U) == 0) {
    }
    note(at(timer) & 1U);
    note(at(timer + 0x24));
}

}  // namespace tricoil::test
