// Test image: clock set-up, pins, SysTick and low-power modes.
#include "tests/virtual_board/firmware/chip/chip.hpp"

namespace tricoil::test {

void run_at(const Pll& pll) {
    set(kApb1, 1U << 28U);
    modify(kRcc + 0x08, 3, 1);  // HSI while the PLL is set up
    wait_for(kRcc + 0x08, 0xC, 4);
    modify(kPwr + 0x80, 1U << 8U, pll.boost ? 0 : 1U << 8U);
    clear(kRcc, 1U << 24U);
    wait_for(kRcc, 1U << 25U, 0);
    at(kRcc + 0x0C) = 2U | (pll.m - 1) << 4U | pll.n << 8U | (pll.r / 2 - 1) << 25U;
    set(kRcc, 1U << 24U);
    set(kRcc + 0x0C, 1U << 24U);
    wait_for(kRcc, 1U << 25U, 1U << 25U);
    modify(kFlash, 0xF, pll.wait_states);
    modify(kRcc + 0x08, 0xF0, 8U << 4U);
    modify(kRcc + 0x08, 3, 3);
    wait_for(kRcc + 0x08, 0xC, 0xC);
    clear(kRcc + 0x08, 0xF0);
}

namespace {

/// Cycles of 1 ms of TIM7, which counts microseconds.
Word cycles_of_a_millisecond(Word hz) {
    set(kApb1, 1U << 5U);
    at(0x40001428) = hz / 1000000 - 1;
    at(0x4000142C) = 999;
    at(0x40001414) = 1;
    at(0x40001410) = 0;
    at(0x40001400) = 1;
    const Word begin = at(0xE0001004);
    while ((at(0x40001410) & 1U) == 0) {
    }
    at(0x40001400) = 0;
    return at(0xE0001004) - begin;
}

}  // namespace

void clocks() {
    at(0xE0001000) = 1;
    static constexpr Pll kPlls[] = {{4, 75, 2, 150000000, false, 4},
                                    {4, 85, 2, 170000000, true, 4},
                                    {4, 50, 2, 100000000, false, 3},
                                    {1, 16, 4, 64000000, false, 2}};
    for (const Pll& pll : kPlls) {
        run_at(pll);
        note(at(kRcc + 0x08) >> 2U & 3U);
        note(cycles_of_a_millisecond(pll.hz));
    }
}

namespace {

void watch_button(Word rising, Word falling) {
    set(kAhb2, 4);
    set(kApb2, 1);
    modify(kGpioC, 3U << 26U, 0);
    modify(0x40010014, 0xF0, 2U << 4U);
    at(0x40010408) = rising << 13U;
    at(0x4001040C) = falling << 13U;
    set(0x40010400, 1U << 13U);
    enable_interrupt(40);
}

void enter_deep_sleep(Word mode) {
    set(kApb1, 1U << 28U);
    modify(kPwr, 7, mode);
    set(0xE000ED10, 4);
    sleep();
    clear(0xE000ED10, 4);
}

}  // namespace

void button() {
    watch_button(1, 1);
    while (ticks < 4) {
        sleep();
        note(at(kGpioC + 0x10) >> 13U & 1U);
    }
}

void tick() {
    at(0xE000E014) = 2000 - 1;  // 1 ms at 16 MHz / 8
    at(0xE000E018) = 0;
    at(0xE000E010) = 3;
    while (ticks < 10) {
        sleep();
    }
    note(at(0xE000E014));
}

void stop() {
    run_at({4, 85, 2, 170000000, true, 4});
    watch_button(1, 0);
    enter_deep_sleep(0);
    note(ticks);
    note(at(kRcc + 0x08) >> 2U & 3U);  // HSI
}

void standby() {
    set(kApb1, 1U << 28U);
    note(at(kPwr + 0x10) >> 8U & 1U);
    at(kPwr + 0x18) = 0x11F;
    set(kPwr + 0x08, 2);
    enter_deep_sleep(3);
}

}  // namespace tricoil::test
