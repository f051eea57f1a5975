// Registers of a timer, and the locks of an advanced one.
#include "sim/virtual_board/peripherals/timer_registers.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"

namespace tricoil::virtual_board {

unsigned Timer::channel_count(const TimerParams& params) {
    return params.advanced && params.channels == 4 ? kMaxChannels : params.channels;
}

std::vector<Register> Timer::list(const TimerParams& params) {
    const std::uint32_t max = params.bits == 32 ? 0xFFFFFFFFU : 0xFFFFU;
    const std::uint32_t channels = ((1U << params.channels) - 1U) << 1U;  // bits of their flags
    std::vector<Register> all{
        {timer::kCr1, 0, "CR1", params.channels > 2 ? 0x13FFU : 0x139FU,
         params.channels > 2 ? "UIFREMAP@11" : "CMS@5-6 UIFREMAP@11"},
        {timer::kCr2, 0, "CR2", params.channels > 0 ? 0x3FF70U : 0x70U,
         "CCPC@0 CCUS@2 CCDS@3 TI1S@7 OIS@8-18 MMS2@20-23 MMS[3]@25"},
        {timer::kSmcr, 0, "SMCR", params.channels > 1 ? 0x30BFF7U : 0x80U,
         params.channels > 1 ? "OCCS@3 ECE@14 SMS[3]@16" : "SMS@0-2 TS@4-6"},
        {timer::kDier, 0, "DIER",
         1U | channels | (params.update_request ? 1U << timer::kUpdateDma : 0U) | (params.compare_request ? channels << 8U : 0U),
         "CC1IE@1 CC2IE@2 CC3IE@3 CC4IE@4 COMIE@5 TIE@6 BIE@7 UDE@8 CC1DE@9 CC2DE@10 CC3DE@11 CC4DE@12 COMDE@13 TDE@14"},
        {timer::kSr, 0, "SR", kAllBits},
        {timer::kEgr, 0, "EGR", 1U | channels, "CC1G@1 CC2G@2 CC3G@3 CC4G@4 COMG@5 TG@6 BG@7"},
        {timer::kCnt, 0, "CNT", kAllBits},
        {timer::kPsc, 0, "PSC", 0xFFFF},
        {timer::kArr, max, "ARR", max | 0xF0000U}};  // more bits than the counter: dithering
    static constexpr std::array kNames{"CCR1", "CCR2", "CCR3", "CCR4", "CCR5", "CCR6"};
    for (unsigned n = 0; n < channel_count(params); ++n) {
        all.push_back({timer::compare(n), 0, kNames[n], max | (n > 3 ? 0xE00F0000U : 0xF0000U)});
    }
    if (params.channels > 0) {
        all.push_back({timer::kModes, 0, "CCMR1", 0x0101FFFF});
        all.push_back({timer::kCcer, 0, "CCER", 0x33FFFF});
        all.push_back({timer::kModes3, 0, "CCMR3", 0x0101FCFC});
        all.push_back({0x54, 0, "DTR2", 0x300FF});
        all.push_back({0x58, 0, "ECR", 0x07FF00FF});
        all.push_back({timer::kInputs, 0, "TISEL", params.input ? 7U : 0U, "TI1SEL@0-3 TI2SEL@8-11 TI3SEL@16-19 TI4SEL@24-27"});
        all.push_back({0x60, params.advanced ? 1U : 0U, "AF1", 0x201, "BKCMP@1-8 BKCMPP@10-13 ETRSEL@14-17"});
        all.push_back({0x64, params.advanced ? 1U : 0U, "AF2", 0x201, "BK2CMP@1-8 BK2CMPP@10-13 OCRSEL@16-18"});
        all.push_back({timer::kDcr, 0, "DCR", 0xF1F1F});
        all.push_back({timer::kDmar, 0, "DMAR", kAllBits});
    }
    if (params.input) {
        all.push_back({0x68, 0, "OR1", 1});  // HSE32EN
    }
    if (params.channels > 2) {
        all.push_back({timer::kModes + 4, 0, "CCMR2", 0x0101FFFF});
    }
    if (params.advanced) {
        all.push_back({timer::kRcr, 0, "RCR", 0xFFFF});
        all.push_back({timer::kBdtr, 0, "BDTR", 0x03FFFFFF, "BKDSRM@26 BK2DSRM@27 BKBID@28 BK2BID@29"});
    }
    return all;
}

/// Bits that BDTR.LOCK protects until the next reset.
std::uint32_t Timer::locked(std::uint32_t offset) const {
    const std::uint32_t level = params_.advanced ? field(registers_[timer::kBdtr], 8, 2) : 0;
    constexpr std::array<std::array<std::uint32_t, 3>, 7> kLocks{{{1, timer::kBdtr, 0x33FF70FF},
                                                                  {2, timer::kBdtr, 0xC00},
                                                                  {1, timer::kCr2, 0xFFF00},
                                                                  {2, timer::kCcer, 0x22AAAA},
                                                                  {3, timer::kModes, 0x01017878},
                                                                  {3, timer::kModes + 4, 0x01017878},
                                                                  {3, timer::kModes3, 0x01017878}}};
    std::uint32_t bits = lock_is_set_ && offset == timer::kBdtr ? 0x300 : 0;
    for (const auto& [from, place, mask] : kLocks) {
        bits |= level >= from && place == offset ? mask : 0;
    }
    return bits;
}

}  // namespace tricoil::virtual_board
