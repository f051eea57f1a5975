// Option bytes (RM0440, "FLASH option bytes"): settings that are stored in the flash and loaded at each power-on.
#pragma once

#include <cstdint>

#include "drivers/stm32g4/registers/flash.hpp"
#include "hal/system_report.hpp"

namespace tricoil::stm32g4 {

/// Settings in FLASH_OPTR that are not those of a tracker board.
constexpr hal::SettingFaults setting_faults(std::uint32_t options) {
    using hal::SettingFault;
    const std::uint32_t protection = options & flash::OPTR_RDP;
    const bool boots_by_option = (options & flash::OPTR_nSWBOOT0) == 0;  // else by the level of the pin BOOT0
    hal::SettingFaults faults;
    faults.set_if((options & flash::OPTR_BOR_LEV) < flash::OPTR_BOR_LEV_2V8, SettingFault::brown_out);
    faults.set_if(protection != flash::OPTR_RDP_0 && protection != flash::OPTR_RDP_2, SettingFault::readout_1);
    faults.set_if(protection == flash::OPTR_RDP_2, SettingFault::readout_2);
    faults.set_if((options & flash::OPTR_DBANK) == 0, SettingFault::one_bank);
    faults.set_if((options & flash::OPTR_BFB2) != 0, SettingFault::other_bank);
    faults.set_if(boots_by_option && (options & flash::OPTR_nBOOT0) == 0, SettingFault::no_flash);
    return faults;
}

}  // namespace tricoil::stm32g4
