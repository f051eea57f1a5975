// Test image: flash, option bytes, watchdog, DMA, and small units.
#include "tests/virtual_board/firmware/chip/chip.hpp"

namespace tricoil::test {

void flash_bank() {
    at(kFlash + 0x08) = 0x45670123;
    at(kFlash + 0x08) = 0xCDEF89AB;
    clear(kFlash, 1U << 10U);
    enable_interrupt(4);
    note(at(kFlash + 0x14) >> 30U);  // OPTLOCK
    for (Word with_interrupt = 0; with_interrupt < 2; ++with_interrupt) {
        at(kFlash + 0x14) = 1U << 15U | with_interrupt << 24U;  // MER2
        set(kFlash + 0x14, 1U << 16U);
        wait_for(kFlash + 0x10, 1U << 16U, 0);
        note(at(kFlash + 0x10));
        note(ticks);
    }
    at(kFlash + 0x14) = 1;
    at(0x08040000) = 0x01234567;
    fence();
    at(0x08040004) = 0x89ABCDEF;
    wait_for(kFlash + 0x10, 1U << 16U, 0);
    at(kFlash + 0x14) = 0;
    note(at(0x08040004));
    note(at(0x0807FFFC));
    note(at(kFlash + 0x14) >> 30U);
}

void option_bytes() {
    note(at(kFlash + 0x20));
    note(at(kFlash + 0x2C) & 0x7F);
    note(at(0x1FFF7800));
}

/// Refreshes in the window, then too early: the reset sets IWDGRSTF.
void watchdog() {
    note(at(kRcc + 0x94) >> 29U & 1U);
    if (mailbox.boots > 1) {
        return;
    }
    at(0x40003000) = 0xCCCC;
    at(0x40003000) = 0x5555;
    at(0x40003004) = 0;
    at(0x40003008) = 800;  // 100 ms
    wait_for(0x4000300C, 7, 0);
    at(0x40003010) = 400;
    wait_for(0x4000300C, 7, 0);
    for (Word refreshes = 0; refreshes < 3; ++refreshes) {
        for (Word n = 0; n < 450000; ++n) {  // 56 ms, or 84 ms with three instructions
            asm volatile("");
        }
        at(0x40003000) = 0xAAAA;
    }
    note(1);
    at(0x40003000) = 0xAAAA;
    for (;;) {
    }
}

void start_channel(Word dma, Word n, Word request, Word peripheral, const volatile void* memory, Word count, Word control) {
    const Word base = channel(dma, n);
    clear(base, 1);
    at(kDmamux + 4 * (n + (dma == kDma2 ? 8 : 0))) = request;
    at(base + 4) = count;
    at(base + 8) = peripheral;
    at(base + 12) = reinterpret_cast<Word>(memory);
    at(base) = control;
    set(base, 1);
}

void dma_channels() {
    set(kAhb1, 7);
    static volatile Word copies[4];
    constexpr Word kControllers[] = {kDma1, kDma2};
    for (const Word dma : kControllers) {
        for (Word n = 0; n < 8; ++n) {
            for (volatile Word& copy : copies) {
                copy = 0;
            }
            start_channel(dma, n, 0, 0x08000000, copies, 4, 1U << 14U | 1U << 6U | 1U << 7U | 2U << 8U | 2U << 10U);
            wait_for(dma, 2U << 4 * n, 2U << 4 * n);
            at(dma + 4) = 1U << 4 * n;
            note(copies[3] == at(0x0800000C) && (at(dma) >> 4 * n & 0xFU) == 0 ? 1 : 0);
        }
    }
}

void units() {
    set(kAhb1, 1U << 12U);
    at(0x40023000) = 0x31323334;  // "1234" in big-endian order
    note(at(0x40023000));
    at(0x40023008) = 1U | 1U << 7U | 1U << 5U;  // reversed, by byte: the CRC-32 of Ethernet, not inverted
    for (const char* text = "123456789"; *text != 0; ++text) {
        byte_at(0x40023000) = static_cast<std::uint8_t>(*text);
    }
    note(~at(0x40023000));
    set(kRcc + 0x98, 1);
    wait_for(kRcc + 0x98, 2, 2);
    set(kAhb2, 1U << 26U);
    set(0x50060800, 4);
    wait_for(0x50060804, 1, 1);
    const Word first = at(0x50060808);
    wait_for(0x50060804, 1, 1);
    note(first != at(0x50060808) ? 1 : 0);
    note(at(0xE0042000) & 0xFFF);
}

}  // namespace tricoil::test
