// Start-up from reset to main, and fault handling: outputs off, then reset.
#include <cstdint>

#include "board/cortex_m/program.hpp"
#include "board/cortex_m/reset.hpp"
#include "board/stm32g4/startup.hpp"
#include "core/base/assertion.hpp"
#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/iwdg.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"
#include "pins.hpp"  // from the board's own folder

namespace tricoil::stm32g4_board {

[[gnu::section(".survives_reset"), gnu::used]] stm32g4::BootRecord boot_record;

namespace {

using namespace tricoil::stm32g4;

constexpr unsigned kGuardLog2Bytes = 15;  // below RAM
constexpr std::uint32_t kGuardBytes = 1U << kGuardLog2Bytes;

/// Waits until the watchdog resets the processor.
[[noreturn]] void wait_for_reset() {
    peripheral<IwdgRegisters>(kIwdgBase).KR = iwdg::KR_start;
    for (;;) {
        asm volatile("" ::: "memory");  // the record must be in memory
    }
}

[[noreturn]] void end_at(const void* return_address) {
    switch_outputs_off();
    std::uint32_t exception = 0;
    asm volatile("mrs %0, ipsr" : "=r"(exception));
    boot_record.note({.ending = BootRecord::kAssertionFailed,
                      .exception = exception,
                      .pc = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(return_address))});
    wait_for_reset();
}

}  // namespace
}  // namespace tricoil::stm32g4_board

[[noreturn]] void tricoil::board::halt() { stm32g4_board::end_at(__builtin_return_address(0)); }

// The fault record has the address after the call; addr2line names the line.
void tricoil::assertion_failed(const char*, const char*, int) { stm32g4_board::end_at(__builtin_return_address(0)); }

/// For programs that end. A tracker board does not end.
void tricoil::board::finish(int) {
    stm32g4_board::switch_outputs_off();
    for (;;) {
        asm volatile("wfi");
    }
}

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): name of the linker script
extern std::uint32_t stack_bottom[], vectors_begin[];

/// No access below the stack, which begins at the start of RAM, and no code in RAM. The guard also covers option bytes, which are
/// read elsewhere, and takes no RAM.
static void protect_memory() {
    using namespace tricoil::stm32g4;
    struct Region {
        std::uint32_t base;
        unsigned log2_bytes;
        std::uint32_t access;
    };
    MpuRegisters& unit = peripheral<MpuRegisters>(kMpuBase);
    std::uint32_t number = 0;
    for (const auto& [base, log2_bytes, access] :
         {Region{0x2000'0000 - tricoil::stm32g4_board::kGuardBytes, tricoil::stm32g4_board::kGuardLog2Bytes, mpu::RASR_AP_none},
          Region{0x2000'0000, 17, mpu::RASR_AP_full | mpu::RASR_C | mpu::RASR_S},
          Region{0x1000'0000, 15, mpu::RASR_AP_full | mpu::RASR_C | mpu::RASR_S}}) {
        unit.RBAR = base | mpu::RBAR_VALID | number++;
        unit.RASR = access | mpu::RASR_XN | (log2_bytes - 1) << mpu::RASR_SIZE_Pos | mpu::RASR_ENABLE;
    }
    unit.CTRL = mpu::CTRL_ENABLE | mpu::CTRL_PRIVDEFENA;
    asm volatile("dsb\n isb" ::: "memory");
}

/// The first write to a memory after a reset may be lost (ES0430 2.2.7).
static void write_first_word(std::uintptr_t memory) {
    auto& word = tricoil::stm32g4::peripheral<volatile std::uint32_t>(memory);
    word = word;
}

static bool is_stack_overflow(std::uint32_t cfsr, std::uint32_t address) {
    using namespace tricoil::stm32g4;
    const auto bottom = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(stack_bottom));
    return (cfsr & (scb::CFSR_MSTKERR | scb::CFSR_STKERR)) != 0 || bottom - 1 - address < tricoil::stm32g4_board::kGuardBytes;
}

/// A loader that starts the program after a firmware update leaves its vectors and clocks set; a reset clears them.
void before_memory() {
    using namespace tricoil;
    write_first_word(this_board::kSram2);
    write_first_word(this_board::kCcmRam);
    stm32g4::ScbRegisters& scb = stm32g4::peripheral<stm32g4::ScbRegisters>(stm32g4::kScbBase);
    const stm32g4::RccRegisters& rcc = stm32g4::peripheral<const stm32g4::RccRegisters>(stm32g4::kRccBase);
    const bool is_fresh = (rcc.CFGR & stm32g4::rcc::CFGR_SWS) == stm32g4::rcc::CFGR_SWS_HSI && scb.VTOR == 0;
    stm32g4::BootRecord& record = stm32g4_board::boot_record;
    if (!is_fresh && record.request != stm32g4::BootRecord::kFreshStart) {  // only once
        record.request = stm32g4::BootRecord::kFreshStart;
        scb.AIRCR = stm32g4::scb::AIRCR_reset;
        for (;;) {
            asm volatile("dsb");
        }
    }
    record.request = 0;
    scb.VTOR = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(vectors_begin));
    protect_memory();
}

/// `frame`: registers that the processor pushed; not readable after a stack overflow.
[[noreturn, gnu::used]] void record_fault(const std::uint32_t* frame, std::uint32_t exception) {
    using namespace tricoil;
    stm32g4_board::switch_outputs_off();
    stm32g4::BootRecord& record = stm32g4_board::boot_record;
    const stm32g4::ScbRegisters& scb = stm32g4::peripheral<const stm32g4::ScbRegisters>(stm32g4::kScbBase);
    const std::uint32_t cfsr = scb.CFSR;
    const std::uint32_t address = (cfsr & stm32g4::scb::CFSR_MMARVALID) != 0   ? scb.MMFAR
                                  : (cfsr & stm32g4::scb::CFSR_BFARVALID) != 0 ? scb.BFAR
                                                                               : 0;
    const bool readable = frame >= stack_bottom && frame + 8 <= stack_top;
    record.note({.ending = is_stack_overflow(cfsr, address) ? stm32g4::BootRecord::kStackOverflow : stm32g4::BootRecord::kFaulted,
                 .exception = exception,
                 .pc = readable ? frame[6] : 0,
                 .lr = readable ? frame[5] : 0,
                 .cfsr = cfsr,
                 .address = address});
    stm32g4_board::wait_for_reset();
}

/// Resets the stack pointer, because the stack may have overflowed. Does not return.
[[noreturn, gnu::naked]] void fault_handler() {
    asm volatile(
        "mrs r0, msp\n"
        "mrs r1, ipsr\n"
        "ldr r2, =stack_top\n"
        "msr msp, r2\n"
        "b record_fault\n");
}
}
