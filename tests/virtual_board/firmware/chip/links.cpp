// Test image: serial ports and CAN.
#include "tests/virtual_board/firmware/chip/chip.hpp"

namespace tricoil::test {

namespace {

constexpr Word kLpuart = 0x40008000;
constexpr Word kUsart2 = 0x40004400;
std::uint8_t line[32];

}  // namespace

void serial_fifo() {
    set(kAhb2, 1);
    set(kApb1More, 1);
    alternate(kGpioA, 2, 12);
    alternate(kGpioA, 3, 12);
    at(kLpuart + 0x0C) = static_cast<Word>(256ULL * 16000000 / 115200);
    at(kLpuart + 0x08) = 1U << 25U | 1U << 28U | 1U;  // two bytes in the FIFO: interrupt
    at(kLpuart) = 1U << 29U | 0xC;
    set(kLpuart, 1);
    wait_for(kLpuart + 0x1C, 3U << 21U, 3U << 21U);
    enable_interrupt(91);
    while (received < 16) {
        sleep();
    }
    wait_for(kLpuart + 0x1C, 1U << 6U, 1U << 6U);
    note(received);
}

void on_lpuart() {
    while ((at(kLpuart + 0x1C) & 1U << 5U) != 0) {
        at(kLpuart + 0x28) = at(kLpuart + 0x24) + 1;
        received = received + 1;
    }
}

void serial_dma() {
    set(kAhb1, 7);
    set(kAhb2, 1);
    set(kApb1, 1U << 17U);
    alternate(kGpioA, 2, 7);
    alternate(kGpioA, 3, 7);
    at(kUsart2 + 0x0C) = 16000000 / 115200;
    at(kUsart2 + 0x04) = 2U << 12U;  // two stop bits
    at(kUsart2) = 0xC;
    set(kUsart2, 1);
    start_channel(kDma2, 7, 26, kUsart2 + 0x24, line, sizeof line, 1U << 7U);
    set(kUsart2 + 0x08, 1U << 6U);
    at(kUsart2 + 0x20) = 1U << 4U;
    set(kUsart2, 1U << 4U);
    enable_interrupt(38);
    while (idle == 0) {
        sleep();
    }
    const Word count = sizeof line - at(channel(kDma2, 7) + 4);
    note(count);
    enable_interrupt(12);
    at(kUsart2 + 0x20) = 1U << 6U;
    start_channel(kDma1, 1, 27, kUsart2 + 0x28, line, count, 1U << 7U | 1U << 4U | 1U << 1U);
    set(kUsart2 + 0x08, 1U << 7U);
    while (ticks == 0) {
        sleep();
    }
    wait_for(kUsart2 + 0x1C, 1U << 6U, 1U << 6U);
    note(ticks);
}

namespace {

constexpr Word can(Word n) { return 0x40006400 + 0x400 * n; }
constexpr Word can_memory(Word n) { return 0x4000A400 + 0x350 * n; }

/// monitor: with the test LBCK the loop-back is internal, otherwise external.
void set_up_can(Word n, Word test, Word monitor, Word queue) {
    set(kApb1, 1U << 25U);
    modify(kCcipr, 3U << 24U, 2U << 24U);
    clear(can(n) + 0x18, 1U << 4U);
    set(can(n) + 0x18, 1);
    wait_for(can(n) + 0x18, 1, 1);
    set(can(n) + 0x18, 2);
    set(can(n) + 0x18, 1U << 14U);  // TXP
    set(can(n) + 0x18, 1U << 12U);  // PXHD: no protocol exceptions
    if (test != 0) {
        set(can(n) + 0x18, 1U << 7U | monitor << 5U);
        at(can(n) + 0x10) = test;
    }
    at(can(n) + 0x1C) = 1U << 16U | 12U << 8U | 1U;  // 16 MHz / 2 / 16 = 500 kbit/s
    at(can(n) + 0xC0) = queue << 24U;
    for (Word word = 0; word < 0x350; word += 4) {
        at(can_memory(n) + word) = 0;
    }
}

void put_frame(Word n, Word buffer, Word id, Word control, Word data) {
    const Word element = can_memory(n) + 0x278 + 72 * buffer;
    at(element) = id << 18U;
    at(element + 4) = control | 4U << 16U;
    at(element + 8) = data;
}

}  // namespace

/// The lowest identifier wins, after the frame that is on the bus already; a cancelled buffer is not sent.
void can_queue() {
    set(kAhb2, 1);
    alternate(kGpioA, 11, 9);
    alternate(kGpioA, 12, 9);
    set_up_can(0, 0, 0, 1);
    at(can(0) + 0xDC) = 7;
    at(can(0) + 0xE0) = 7;
    clear(can(0) + 0x18, 1);
    wait_for(can(0) + 0x18, 1, 0);
    put_frame(0, 0, 0x300, 0, 1);
    put_frame(0, 1, 0x200, 0, 2);
    put_frame(0, 2, 0x100, 0, 3);
    at(can(0) + 0xCC) = 1;  // 0x300 goes on the bus
    at(can(0) + 0xCC) = 6;
    at(can(0) + 0xD0) = 2;  // 0x200 is cancelled
    note(at(can(0) + 0xD8));
    wait_for(can(0) + 0xC8, 7, 0);
    note(at(can(0) + 0xD4));
    note(at(can(0) + 0x50) & 0x380U);
}

void can_loop() {
    for (Word n = 0; n < 3; ++n) {
        set_up_can(n, 1U << 4U, n == 2 ? 0 : 1, 0);                         // FDCAN3: external
        at(can_memory(n)) = 2U << 30U | 5U << 27U | 0x123U << 16U | 0x7FF;  // priority, FIFO 0
        at(can(n) + 0x80) = 1U << 16U | 2U << 4U | 2U << 2U;
        clear(can(n) + 0x18, 1);
        put_frame(n, 0, 0x123, 1U << 23U | 0x5AU << 24U, 0x11223344 + n);
        put_frame(n, 1, 0x124, 0, 0);  // no filter accepts it
        at(can(n) + 0xCC) = 3;
        wait_for(can(n) + 0xC8, 3, 0);
        note(at(can(n) + 0x90) & 0xF);
        note(at(can_memory(n) + 0xB0 + 8));
        note(at(can_memory(n) + 0x260 + 4) >> 24U);  // message marker of the transmit event
        note(at(can(n) + 0x88));
        at(can(n) + 0xE8) = 0;
        note(at(can(n) + 0xE4) & 7U);
    }
}

}  // namespace tricoil::test
