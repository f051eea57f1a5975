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
    note(at(0xE0042000) & 0xFFF);
}

/// A wrong order of programming, with the error interrupt of the vendor's driver.
void flash_error() {
    at(kFlash + 0x08) = 0x45670123;
    at(kFlash + 0x08) = 0xCDEF89AB;
    enable_interrupt(4);
    at(kFlash + 0x14) = 1U << 24U | 1U << 25U;  // EOPIE, ERRIE
    set(kFlash + 0x14, 1);
    at(0x08040004) = 1;  // not a multiple of eight
    note(at(kFlash + 0x10));
    note(ticks);
}

/// Page 32 of the bank that runs, with code that is replaced. At last a double-word that is not erased.
void flash_running() {
    constexpr Word kPage = 0x08010000;
    at(kFlash + 0x08) = 0x45670123;
    at(kFlash + 0x08) = 0xCDEF89AB;
    clear(kFlash, 1U << 10U);
    at(0xE000EDFC) = 1U << 24U;
    at(0xE0001000) = 1;
    const auto erase = [] {
        at(kFlash + 0x14) = 1U << 1U | 32U << 3U;
        set(kFlash + 0x14, 1U << 16U);
        wait_for(kFlash + 0x10, 1U << 16U, 0);
        at(kFlash + 0x14) = 1;
    };
    const auto program = [](Word place, Word first, Word second) {
        at(place) = first;
        at(place + 4) = second;
        wait_for(kFlash + 0x10, 1U << 16U, 0);
    };
    Word begin = at(0xE0001004);
    erase();
    note(at(0xE0001004) - begin);
    begin = at(0xE0001004);
    program(kPage, 0x11223344, 0x55667788);
    note(at(0xE0001004) - begin);
    note(at(kPage));
    note(at(kPage + 4));
    note(at(kPage + 8));
    note(at(kPage + 0x800));
    for (Word value = 7; value > 3; value -= 2) {
        program(kPage + 0x10, 0x47702000U | value, 0);  // movs r0, #value; bx lr
        note(reinterpret_cast<Word (*)()>(kPage + 0x11)());
        erase();
    }
    program(kPage, 0x11223344, 0);
    program(kPage, 1, 2);  // not erased: PROGERR
    note(at(kPage));
}

namespace {

constexpr Word kRamBits = 0x22000000;
constexpr Word kPeripheralBits = 0x42000000;

/// Word of the bit-band that stands for one bit.
volatile Word& bit_of(Word base, Word offset, Word bit) { return at(base + 32 * offset + 4 * bit); }

}  // namespace

void bit_band() {
    static volatile Word word;
    word = 0x100;
    const Word offset = reinterpret_cast<Word>(&word) - 0x20000000;
    bit_of(kRamBits, offset, 31) = 1;
    bit_of(kRamBits, offset, 8) = 0xFE;  // only bit 0 counts
    note(word);
    note(bit_of(kRamBits, offset, 31));
    set(kAhb1, 1U << 12U);
    bit_of(kPeripheralBits, 0x23008, 7) = 1;  // CRC_CR.REV_OUT
    note(at(0x40023008));
    note(bit_of(kPeripheralBits, 0x23008, 7));
}

/// Copies a function to RAM and runs it, then overwrites it with another one.
void code_in_ram() {
    alignas(4) static volatile std::uint16_t code[2];
    const auto run = reinterpret_cast<Word (*)()>(reinterpret_cast<Word>(code) | 1U);
    for (Word value = 5; value < 8; value += 2) {
        code[0] = static_cast<std::uint16_t>(0x2000U | value);  // movs r0, #value
        code[1] = 0x4770;                                       // bx lr
        fence();
        note(run());
    }
}

/// Settings whose unit is off, from the vendor's drivers.
void units_off() {
    set(kPwr + 0x80, 1U << 8U);  // the clock of PWR is off: ignored
    note(at(kPwr + 0x80));
    set(kRcc + 0x58, 1U << 28U);
    note(at(kPwr + 0x80));
    set(kApb2, 1);               // SYSCFG, EXTI, OPAMP
    set(0x40010400, 1U << 18U);  // EXTI: USB wake-up
    note(at(0x40010400) >> 18U & 1U);
    set(0xE000ED24, 7U << 16U);  // SHCSR: all faults have their own exceptions
    note(at(0xE000ED24) >> 16U);
    if ((at(0xE0000E80) & 1U) != 0) {  // ITM_TCR.ITMENA
        note(1);
    }
    at(0x40010300) = 1U << 31U | 3U << 5U;  // OPAMP1: follower, LOCK
    at(0x40010300) = 0;
    note(at(0x40010300));
}

void divide_by_zero() {
    Word quotient = 1;
    asm volatile("udiv %0, %1, %2" : "=r"(quotient) : "r"(7U), "r"(0U));
    note(quotient);
    set(0xE000ED14, 1U << 4U);
    fence();
    asm volatile("udiv %0, %1, %2" : "=r"(quotient) : "r"(8U), "r"(2U));
    note(quotient);
    asm volatile("udiv %0, %1, %2" : "=r"(quotient) : "r"(7U), "r"(0U));
    note(quotient);
}

void read_unaligned() {
    static volatile Word words[2];
    const Word address = reinterpret_cast<Word>(words) + 1;
    Word value = 1;
    asm volatile("ldr %0, [%1]" : "=r"(value) : "r"(address));
    note(value);
    set(0xE000ED14, 1U << 3U);
    fence();
    asm volatile("ldr %0, [%1]" : "=r"(value) : "r"(address));
    note(value);
}

}  // namespace tricoil::test
