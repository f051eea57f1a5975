#include "drivers/stm32g4/clocks.hpp"

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

// At 16 MHz one poll takes at least 0.5 us. The crystal needs 2 ms (DS12288, HSE start-up), the PLL 40 us.
constexpr std::uint32_t kCrystalPolls = 20'000;
constexpr std::uint32_t kQuickPolls = 2'000;
constexpr std::uint32_t kHalfSpeedPolls = 200;  // the core must run at half speed for at least 1 us before it exceeds 80 MHz

constexpr std::uint32_t kFlashWaitStates = 4;  // 170 MHz in boost mode (RM0440, "Read access latency")
constexpr std::uint32_t kPllFactor = 85;       // multiplies 4 MHz; the output is half of that
constexpr std::uint32_t kCrystalDivider = 6;   // 24 MHz
constexpr std::uint32_t kInternalDivider = 4;  // 16 MHz

void modify(volatile std::uint32_t& target, std::uint32_t clear, std::uint32_t set) { target = (target & ~clear) | set; }

bool start_pll(RccRegisters& rcc, std::uint32_t source, std::uint32_t divider) {
    rcc.PLLCFGR = source | (divider - 1) << rcc::PLLCFGR_PLLM_Pos | kPllFactor << rcc::PLLCFGR_PLLN_Pos | rcc::PLLCFGR_PLLREN;
    modify(rcc.CR, 0, rcc::CR_PLLON);
    const bool locked = wait_until([&] { return (rcc.CR & rcc::CR_PLLRDY) != 0; }, kQuickPolls, "PLL does not lock").ok();
    if (!locked) {
        modify(rcc.CR, rcc::CR_PLLON, 0);
    }
    return locked;
}

/// Prepares for more than 150 MHz: regulator boost mode and flash wait states.
bool prepare_full_speed(PwrRegisters& pwr, FlashRegisters& flash) {
    modify(pwr.CR5, pwr::CR5_R1MODE, 0);
    modify(flash.ACR, flash::ACR_LATENCY, kFlashWaitStates | flash::ACR_PRFTEN | flash::ACR_ICEN | flash::ACR_DCEN);
    return wait_until([&] { return (pwr.SR2 & pwr::SR2_VOSF) == 0 && (flash.ACR & flash::ACR_LATENCY) == kFlashWaitStates; },
                      kQuickPolls, "regulator or flash is not ready")
        .ok();
}

bool switch_to_pll(RccRegisters& rcc) {
    modify(rcc.CFGR, rcc::CFGR_HPRE, rcc::CFGR_HPRE_DIV2);
    modify(rcc.CFGR, rcc::CFGR_SW, rcc::CFGR_SW_PLL);
    const bool switched =
        wait_until([&] { return (rcc.CFGR & rcc::CFGR_SWS) == rcc::CFGR_SWS_PLL; }, kQuickPolls, "core clock does not switch")
            .ok();
    for (std::uint32_t n = 0; n < kHalfSpeedPolls; ++n) {
        static_cast<void>(rcc.CFGR);  // a bus read takes a few cycles
    }
    modify(rcc.CFGR, rcc::CFGR_HPRE, 0);
    return switched;
}

}  // namespace

CoreClock start_core_clock(RccRegisters& rcc, PwrRegisters& pwr, FlashRegisters& flash) {
    modify(rcc.APB1ENR1, 0, rcc::APB1ENR1_PWREN);
    static_cast<void>(rcc.APB1ENR1);  // the clock is on two cycles later
    if (!prepare_full_speed(pwr, flash)) {
        return CoreClock::unmultiplied;
    }
    modify(rcc.CR, 0, rcc::CR_HSEON);
    const bool crystal = wait_until([&] { return (rcc.CR & rcc::CR_HSERDY) != 0; }, kCrystalPolls, "crystal does not start").ok();
    if (crystal && start_pll(rcc, rcc::PLLCFGR_PLLSRC_HSE, kCrystalDivider) && switch_to_pll(rcc)) {
        modify(rcc.CR, 0, rcc::CR_CSSON);
        return CoreClock::crystal;
    }
    modify(rcc.CR, rcc::CR_HSEON, 0);
    if (start_pll(rcc, rcc::PLLCFGR_PLLSRC_HSI, kInternalDivider) && switch_to_pll(rcc)) {
        return CoreClock::internal;
    }
    return CoreClock::unmultiplied;
}

Status start_usb_clock(RccRegisters& rcc) {
    modify(rcc.CRRCR, 0, rcc::CRRCR_HSI48ON);
    modify(rcc.CCIPR, rcc::CCIPR_CLK48SEL, 0);
    return wait_until([&] { return (rcc.CRRCR & rcc::CRRCR_HSI48RDY) != 0; }, kQuickPolls * 10,
                      "48 MHz oscillator does not start");
}

}  // namespace tricoil::stm32g4
