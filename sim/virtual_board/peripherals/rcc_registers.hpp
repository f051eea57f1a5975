// Registers of reset and clock control with their modelled bits (RM0440 section 7).
#pragma once

#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

/// Enables of clocks in sleep mode: only the reset value is modelled, with which no clock stops.
inline std::vector<Register> rcc_registers() {
    return {
        {0x00, 0x500, "CR", 0x030B0700, "HSEBYP@18"},
        {0x04, 0x40000000, "ICSCR", 0x00FF0000, "HSITRIM@24-30"},
        {0x08, 0x5, "CFGR", 0x7F003FFF},
        {0x0C, 0x1000, "PLLCFGR", 0xFF737FF3},
        {0x18, 0, "CIER", 0x43B, "LSECSSIE@9"},
        {0x1C, 0, "CIFR", kAllBits},
        {0x20, 0, "CICR", kAllBits},
        {0x28, 0, "AHB1RSTR", kAllBits},
        {0x2C, 0, "AHB2RSTR", kAllBits},
        {0x30, 0, "AHB3RSTR", kAllBits},
        {0x38, 0, "APB1RSTR1", kAllBits},
        {0x3C, 0, "APB1RSTR2", kAllBits},
        {0x40, 0, "APB2RSTR", kAllBits},
        {0x48, 0x100, "AHB1ENR", kAllBits},
        {0x4C, 0, "AHB2ENR", kAllBits},
        {0x50, 0, "AHB3ENR", kAllBits},
        {0x58, 0x400, "APB1ENR1", kAllBits},
        {0x5C, 0, "APB1ENR2", kAllBits},
        {0x60, 0, "APB2ENR", kAllBits},
        {0x68, 0x130F, "AHB1SMENR", 0, "clock_off_in_sleep_mode@0-31"},
        {0x6C, 0x050F667F, "AHB2SMENR", 0, "clock_off_in_sleep_mode@0-31"},
        {0x70, 0x101, "AHB3SMENR", 0, "clock_off_in_sleep_mode@0-31"},
        {0x78, 0xD2FECD3F, "APB1SMENR1", 0, "clock_off_in_sleep_mode@0-31"},
        {0x7C, 0x103, "APB1SMENR2", 0, "clock_off_in_sleep_mode@0-31"},
        {0x80, 0x0437F801, "APB2SMENR", 0, "clock_off_in_sleep_mode@0-31"},
        {0x88, 0, "CCIPR", 0xFF000FFF, "I2C1SEL@12-13 I2C2SEL@14-15 I2C3SEL@16-17 LPTIM1SEL@18-19 SAI1SEL@20-21 I2S23SEL@22-23"},
        {0x90, 0, "BDCR", 0x0001001B, "LSEBYP@2 LSECSSON@5 LSECSSD@6 RTCSEL@8-9 RTCEN@15 LSCOEN@24 LSCOSEL@25"},
        {0x94, 0, "CSR", 0xFF800003},
        {0x98, 0, "CRRCR", 0xFF83},
        {0x9C, 0, "CCIPR2", 0, "I2C4SEL@0-1 QSPISEL@20-21"},
    };
}

}  // namespace tricoil::virtual_board
