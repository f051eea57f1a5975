// Test image: runs one processor test per job and writes the results into the mailbox.
#include "tests/virtual_board/firmware/mailbox.hpp"

using tricoil::test::Job;
using tricoil::test::Mailbox;
using Word = std::uint32_t;

namespace {

[[gnu::section(".mailbox")]] Mailbox mailbox;

volatile Word& at(Word address) { return *reinterpret_cast<volatile Word*>(address); }

constexpr Word kSetEnable = 0xE000E100;
constexpr Word kSetPending = 0xE000E200;
constexpr Word kPriorities = 0xE000E400;
constexpr Word kIcsr = 0xE000ED04;
constexpr Word kAircr = 0xE000ED0C;
constexpr Word kShcsr = 0xE000ED24;
constexpr Word kCpacr = 0xE000ED88;
constexpr Word kFpccr = 0xE000EF34;
constexpr Word kFpcar = 0xE000EF38;

void note(Word value) {
    if (mailbox.count < tricoil::test::kResults) {
        mailbox.results[mailbox.count] = value;
        mailbox.count = mailbox.count + 1;
    }
}

Word stack_pointer() {
    Word value;
    asm volatile("mov %0, sp" : "=r"(value));
    return value;
}
Word control() {
    Word value;
    asm volatile("mrs %0, control" : "=r"(value));
    return value;
}
Word active_exception() {
    Word value;
    asm volatile("mrs %0, ipsr" : "=r"(value));
    return value;
}
void mask_below(Word priority) { asm volatile("msr basepri, %0" : : "r"(priority) : "memory"); }
void fence() { asm volatile("dsb\n isb" : : : "memory"); }

void enable(Word interrupt, Word priority) {
    reinterpret_cast<volatile std::uint8_t*>(kPriorities)[interrupt] = static_cast<std::uint8_t>(priority << 4U);
    at(kSetEnable + 4 * (interrupt / 32)) = 1U << interrupt % 32;
}
void pend(Word interrupt) { at(kSetPending + 4 * (interrupt / 32)) = 1U << interrupt % 32; }

float half(float x) {
    float y;
    asm volatile("vmul.f32 %0, %1, %2" : "=t"(y) : "t"(x), "t"(0.5F));
    return y;
}

volatile Word lr_seen;
volatile float product;

}  // namespace

extern "C" {
extern Word bss_begin, bss_end, stack_top;

// Interrupt 0 pends interrupt 1, except in the job lazy_float. Interrupt 0 records its entry and exit, the others only their
// entry.
void interrupt_0() {
    note(100 + active_exception());
    if (mailbox.job == Job::lazy_float) {
        note(at(kFpccr) & 1U);
        note(stack_pointer() <= at(kFpcar) ? 1 : 0);
        note(*reinterpret_cast<volatile Word*>(at(kFpcar)));  // not yet written: old stack content
        product = half(product);                              // now the registers must be saved
        fence();
        note(at(kFpccr) & 1U);
        note(*reinterpret_cast<volatile Word*>(at(kFpcar)));
        note(control() & 4U);
    } else {
        pend(1);
        fence();
    }
    note(200 + active_exception());
}
void interrupt_1() { note(100 + active_exception()); }
void interrupt_2() { note(100 + active_exception()); }
void svc_handler() { note(100 + active_exception()); }
[[gnu::used]] void note_fault(const Word* frame) {
    note(100 + active_exception());
    note(at(0xE000ED28));  // CFSR
    note(at(0xE000ED2C));  // HFSR
    note(at(0xE000ED38));  // BFAR
    note(reinterpret_cast<Word>(frame) >= 0x20000000 ? frame[6] : 0);
    mailbox.done = 1;
    for (;;) {
        asm volatile("wfi");
    }
}
// Of every fault exception.
[[gnu::naked]] void hard_fault_handler() { asm volatile("mrs r0, msp\n ldr r1, =stack_top\n msr msp, r1\n b note_fault"); }
void sys_tick_handler() { note(100 + active_exception()); }
void overflow_handler() {
    pend(3);
    fence();
}

[[gnu::noinline]] void interrupt_with_float() {
    enable(0, 3);
    float kept;
    asm volatile("vmov.f32 s0, #3.0" : : : "s0");
    note(control() & 4U);
    pend(0);
    asm volatile("dsb\n isb\n vmov %0, s0" : "=t"(kept) : : "s0");
    note(static_cast<Word>(static_cast<int>(kept)));
}
[[gnu::noinline]] void use_float() { product = half(product); }

void run() {
    mailbox.count = 0;
    switch (mailbox.job) {
        case Job::count_instructions: {
            Word n = 1000;
            asm volatile("1: subs %0, #1\n bne 1b" : "+r"(n));  // two instructions each time
            break;
        }
        case Job::nest_interrupts:
            enable(0, 3);
            enable(1, 2);
            pend(0);
            fence();
            break;
        case Job::tail_chain:
            enable(0, 3);
            enable(1, 3);
            pend(0);
            fence();
            break;
        case Job::late_arrival:
            enable(2, 5);
            enable(1, 1);
            asm volatile("cpsid i");
            pend(2);
            pend(1);
            asm volatile("cpsie i");
            fence();
            break;
        case Job::mask_by_basepri:
            enable(1, 4);
            enable(2, 2);
            mask_below(0x30);
            pend(1);
            pend(2);
            fence();
            note(1);
            mask_below(0);
            fence();
            note(2);
            break;
        case Job::mask_by_primask:
            enable(1, 4);
            asm volatile("cpsid i" : : : "memory");
            pend(1);
            fence();
            note(1);
            asm volatile("wfi" : : : "memory");  // returns at once, because an interrupt is pending
            note(2);
            asm volatile("cpsie i" : : : "memory");
            fence();
            note(3);
            break;
        case Job::lazy_float:
            at(kCpacr) = at(kCpacr) | 0x00F00000U;
            fence();
            interrupt_with_float();
            break;
        case Job::process_stack: {
            alignas(8) static volatile Word stack[64];
            enable(1, 3);
            const Word main_stack = stack_pointer();
            asm volatile("msr psp, %0\n mov r4, #2\n msr control, r4\n isb" : : "r"(&stack[64]) : "r4", "memory");
            pend(1);
            fence();
            note(stack_pointer() == reinterpret_cast<Word>(&stack[64]) ? 1 : 0);
            asm volatile("mov r4, #0\n msr control, r4\n isb" : : : "r4", "memory");
            note(stack_pointer() == main_stack ? 1 : 0);
            note(stack[64 - 1] >> 24U);  // Thumb bit of the stacked xPSR
            break;
        }
        case Job::system_call:
            asm volatile("svc #7" : : : "memory");
            note(1);
            break;
        case Job::sys_tick_sleep:
            at(0xE000E014) = 16000 - 1;
            at(0xE000E018) = 0;
            at(0xE000E010) = 7;
            for (int i = 0; i < 3; ++i) {
                asm volatile("wfi" : : : "memory");
            }
            at(0xE000E010) = 0;
            break;
        case Job::reset_itself:
            if (mailbox.boots < 3) {
                at(kAircr) = 0x05FA0004;
                for (;;) {
                }
            }
            break;
        case Job::cycle_counter: {
            at(0xE0001000) = 1;
            asm volatile("b 1f\n 1:");  // time is counted per basic block
            const Word before = at(0xE0001004);
            asm volatile("b 1f\n 1: .rept 100\n nop\n .endr");
            asm volatile("b 1f\n 1:");
            note(at(0xE0001004) - before);
            break;
        }
        case Job::read_nowhere:
            note(at(0x30000000));
            break;
        case Job::write_flash:
            at(0x08001000) = 1;
            break;
        case Job::bus_fault:
            at(kShcsr) = 7U << 16U;
            note(at(0x30000000));
            break;
        case Job::usage_fault:
            at(kShcsr) = 7U << 16U;
            asm volatile(".short 0xDE00");
            break;
        case Job::undefined:
            asm volatile(".short 0xDE00");
            break;
        case Job::jump_nowhere:
            reinterpret_cast<void (*)()>(0x30000001)();
            break;
        case Job::float_while_off:
            use_float();
            break;
        case Job::unclocked:
            note(at(0x48000000));
            break;
        case Job::no_handler:
            enable(40, 1);
            pend(40);
            fence();
            break;
        case Job::stack_overflow:
            enable(3, 1);
            asm volatile("ldr r0, =0x20000010\n mov sp, r0" : : : "r0");
            pend(3);
            fence();
            break;
        case Job::bootloader:
            asm volatile("ldr r0, =0x1FFF0000\n ldr r1, [r0, #4]\n bx r1");
            break;
        case Job::hints:
            asm volatile("sev\n wfe\n nop\n yield");
            note(1);
            break;
        case Job::sleep_on_exit:
            at(0xE000ED10) = 2;
            at(0xE000E014) = 16000 - 1;
            at(0xE000E018) = 0;
            at(0xE000E010) = 7;
            asm volatile("wfi" : : : "memory");
            note(1);
            break;
        case Job::hang:
            for (;;) {
            }
        case Job::nothing:
            break;
    }
    mailbox.done = 1;
    for (;;) {
        asm volatile("wfi");
    }
}

[[gnu::naked]] void reset_handler() { asm volatile("bl start"); }
[[gnu::used]] void start() {
    for (Word* word = &bss_begin; word != &bss_end; ++word) {
        *word = 0;
    }
    mailbox.boots = mailbox.boots + 1;
    run();
}

using Handler = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Handler vectors[16 + 102] = {
    reinterpret_cast<Handler>(&stack_top),
    reset_handler,
    nullptr,
    hard_fault_handler,
    hard_fault_handler,
    hard_fault_handler,
    hard_fault_handler,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    svc_handler,
    nullptr,
    nullptr,
    nullptr,
    sys_tick_handler,
    interrupt_0,
    interrupt_1,
    interrupt_2,
    overflow_handler,
};
}
