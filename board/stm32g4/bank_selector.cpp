// First code after a reset: maps the flash bank with the present program to the start of the flash, and starts the program. It
// lies alone in the first pages of bank 1, calls nothing outside them, and is not replaced by an update: power may fail at any
// time. A program may set FB_MODE (RM0440, SYSCFG_MEMRMP). The processor's own way, option BFB2, needs a write of option bytes
// for each change, and the loader in ROM, whose older versions do not jump to bank 2 (AN2606).
#include "board/cortex_m/vectors.hpp"
#include "board/stm32g4/flash_layout.hpp"
#include "board/stm32g4/startup.hpp"
#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/iwdg.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"
#include "drivers/stm32g4/registers/syscfg.hpp"

namespace {

using namespace tricoil::stm32g4;
using namespace tricoil::stm32g4_board;

constexpr std::uintptr_t kLoader = 0x1FFF'0000;  // system memory; has its own vectors (AN2606)
constexpr unsigned kStartHalfWords = 11;         // of map_and_start

/// The first write to a memory after a reset may be lost (ES0430 2.2.7); here it is that of no return address.
[[noreturn, gnu::naked, gnu::used]] void start() { asm volatile("push {r0}\n pop {r0}\n b select_bank\n"); }

/// A double-word of the log whose programming was interrupted. Any value that it reads as is harmless: both banks hold a program
/// then.
[[gnu::used]] void skip_damage() {
    peripheral<FlashRegisters>(kFlashBase).ECCR = flash::ECCR_ECCD;
    asm volatile("dsb\n nop\n nop" ::: "memory");
}

[[noreturn, gnu::used]] void restart() {
    peripheral<ScbRegisters>(kScbBase).AIRCR = scb::AIRCR_reset;
    for (;;) {
        asm volatile("dsb");
    }
}

/// Selects a bank, loads the stack pointer and jumps. Position-independent: it runs in RAM if the flash below it changes.
[[gnu::naked]] void map_and_start(volatile std::uint32_t*, std::uint32_t, const std::uint32_t*) {
    asm volatile("str r1, [r0]\n ldr r3, [r0]\n dsb\n isb\n ldr r3, [r2]\n msr msp, r3\n ldr r3, [r2, #4]\n bx r3\n");
}

/// Index of the bank that the newest entry names.
unsigned confirmed_bank() {
    unsigned bank = 0;
    const auto* word = &peripheral<const volatile std::uint32_t>(kFlash + kLogOffset);
    for (std::size_t n = 0; n < kLogEntries; ++n, word += 2) {
        const std::uint32_t low = word[0];
        const std::uint32_t high = word[1];
        if ((low & high) == ~0U) {
            break;
        }
        if (high == ~low && (low == kBankEntry[0] || low == kBankEntry[1])) {
            bank = low == kBankEntry[1] ? 1 : 0;
        }
    }
    return bank;
}

bool has_program(unsigned bank) {
    const auto* vectors = &peripheral<const volatile std::uint32_t>(kFlash + bank * kFlashBankBytes + kProgramOffset);
    return is_program(vectors[0], vectors[1]);
}

[[noreturn]] void enter_loader() {
    peripheral<ScbRegisters>(kScbBase).VTOR = kLoader;
    const auto* vectors = &peripheral<const std::uint32_t>(kLoader);
    asm volatile("msr msp, %0\n bx %1\n" ::"r"(vectors[0]), "r"(vectors[1]));
    __builtin_unreachable();
}

/// The caches may hold words of bank 1; the program switches them on again.
[[noreturn]] void start_bank_2() {
    auto& acr = peripheral<FlashRegisters>(kFlashBase).ACR;
    const std::uint32_t off = acr & ~(flash::ACR_ICEN | flash::ACR_DCEN | flash::ACR_PRFTEN);
    acr = off;
    acr = off | flash::ACR_ICRST | flash::ACR_DCRST;
    acr = off;
    volatile std::uint16_t code[kStartHalfWords];
    const auto from = reinterpret_cast<std::uintptr_t>(&map_and_start) & ~std::uintptr_t{1};
    for (unsigned n = 0; n < kStartHalfWords; ++n) {
        code[n] = peripheral<const volatile std::uint16_t>(from + 2 * n);
    }
    asm volatile("dsb\n isb" ::: "memory");
    auto& memory_map = peripheral<SyscfgRegisters>(kSyscfgBase).MEMRMP;
    const auto run = reinterpret_cast<decltype(&map_and_start)>(reinterpret_cast<std::uintptr_t>(&code[0]) | 1U);
    run(&memory_map, memory_map | syscfg::MEMRMP_FB_MODE, &peripheral<const std::uint32_t>(kFlash + kProgramOffset));
    __builtin_unreachable();
}

}  // namespace

/// No peripheral is on yet, in particular no watchdog.
extern "C" [[noreturn, gnu::used]] void select_bank() {
    const std::uint32_t request = boot_record.request;
    if (request == BootRecord::kEnterLoader) {
        boot_record.request = 0;
        enter_loader();
    }
    unsigned bank = confirmed_bank();
    if (request == BootRecord::kTryOtherBank) {  // once: every other end of the trial than its confirmation leads back
        boot_record.request = 0;
        bank = 1 - bank;
        peripheral<IwdgRegisters>(kIwdgBase).KR = iwdg::KR_start;  // 0.5 s (RM0440, reset values of IWDG)
    }
    auto& rcc = peripheral<RccRegisters>(kRccBase);
    rcc.APB2ENR = rcc.APB2ENR | rcc::APB2ENR_SYSCFGEN;
    static_cast<void>(rcc.APB2ENR);  // the clock starts two cycles later
    if (has_program(bank) ? bank == 1 : has_program(1)) {
        start_bank_2();
    }
    map_and_start(&peripheral<SyscfgRegisters>(kSyscfgBase).MEMRMP, 0, &peripheral<const std::uint32_t>(kFlash + kProgramOffset));
    __builtin_unreachable();
}

namespace {
/// Only the exceptions that can occur here: NMI and faults.
struct BootVectors {
    std::uint32_t* stack;
    tricoil::board::Handler exceptions[15];
};
[[gnu::section(".boot_vectors"), gnu::used]] constinit const BootVectors kBootVectors = {
    stack_top, {start, skip_damage, restart, restart, restart, restart}};
}  // namespace
