// Registers of a converter with their modelled bits (RM0440 section 21).
#pragma once

#include <vector>

#include "sim/virtual_board/machine/peripheral.hpp"

namespace tricoil::virtual_board {

inline std::vector<Register> adc_registers() {
    constexpr const char* kOffsets = "OFFSETPOS@24";
    return {{0x00, 0, "ISR", kAllBits},
            {0x04, 0, "IER", 0x9D, "EOSMPIE@1 JEOCIE@5 JEOSIE@6 AWD2IE@8 AWD3IE@9 JQOVFIE@10"},
            {0x08, 0, "CR", 0xB0000017, "JADSTART@3 JADSTP@5 ADCALDIF@30"},
            {0x0C, 0x80000000, "CFGR", 0xFCCEBFFB, "AUTDLY@14 DISCEN@16 JDISCEN@20 JQM@21 JAWD1EN@24 JAUTO@25"},
            {0x10, 0, "CFGR2", 0x103FD, "JOVSE@1 ROVSM@10 SWTRIG@25 BULB@26 SMPTRIG@27"},
            {0x14, 0, "SMPR1", 0x3FFFFFFF, "SMPPLUS@31"},
            {0x18, 0, "SMPR2", 0x07FFFFFF},
            {0x20, 0x0FFF0000, "TR1", 0x0FFF0FFF, "AWDFILT@12-14"},
            {0x24, 0x00FF0000, "TR2", 0, "LT2@0-7 HT2@16-23"},
            {0x28, 0x00FF0000, "TR3", 0, "LT3@0-7 HT3@16-23"},
            {0x30, 0, "SQR1", kAllBits},
            {0x34, 0, "SQR2", kAllBits},
            {0x38, 0, "SQR3", kAllBits},
            {0x3C, 0, "SQR4", kAllBits},
            {0x40, 0, "DR", kAllBits},
            {0x4C, 0, "JSQR", 0, "JL@0-1 JEXTSEL@2-6 JEXTEN@7-8 JSQ1@9-13 JSQ2@15-19 JSQ3@21-25 JSQ4@27-31"},
            {0x60, 0, "OFR1", 0xFE000FFF, kOffsets},
            {0x64, 0, "OFR2", 0xFE000FFF, kOffsets},
            {0x68, 0, "OFR3", 0xFE000FFF, kOffsets},
            {0x6C, 0, "OFR4", 0xFE000FFF, kOffsets},
            {0xA0, 0, "AWD2CR", 0, "AWD2CH@0-18"},
            {0xA4, 0, "AWD3CR", 0, "AWD3CH@0-18"},
            {0xB0, 0, "DIFSEL", 0, "DIFSEL@0-18"},
            {0xB4, 0, "CALFACT", 0x7F, "CALFACT_D@16-22"},
            {0xC0, 0, "GCOMP", 0x3FFF}};
}

}  // namespace tricoil::virtual_board
