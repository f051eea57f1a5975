#include "board/host/commands/device_condition.hpp"

#include <fmt/format.h>

#include <array>

namespace tricoil::host {
namespace {

constexpr std::array<const char*, 5> kResetReasons{"power-on", "reset pin", "software", "watchdog", "program error"};
constexpr std::array<const char*, 5> kCrashes{"none", "processor fault", "assertion", "watchdog", "stack overflow"};

constexpr std::array<const char*, 3> kImages{"not checked", "sound", "damaged"};
constexpr std::uint8_t kDamaged = 2;

/// Bits of ConditionMessage::settings.
enum Setting : std::uint16_t {
    kChecked = 1U << 0U,
    kBrownOut = 1U << 1U,
    kReadoutOne = 1U << 2U,
    kReadoutTwo = 1U << 3U,
    kOneBank = 1U << 4U,
    kOtherBank = 1U << 5U,
    kNotFlash = 1U << 6U,
};
struct SettingText {
    Setting bit;
    const char* problem;
    const char* option;  // of STM32_Programmer_CLI -c port=SWD -ob; null: no remedy
};
constexpr std::array<SettingText, 6> kSettings{{
    {kBrownOut, "brown-out level below 2.8 V: a falling supply may damage the stored calibration", "BOR_LEV=4"},
    {kReadoutOne, "read protection level 1: new firmware needs an erase of the whole flash", "RDP=0xAA"},
    {kReadoutTwo, "read protection level 2: this firmware can never be replaced; use another board for updates", nullptr},
    {kOneBank, "the flash is one bank: no calibration can be stored", "DBANK=1"},
    {kOtherBank, "the processor tries to boot from bank 2, which holds the calibration", "BFB2=0"},
    {kNotFlash, "the processor boots its loader instead of the firmware", "nBOOT0=1"},
}};

std::string hexadecimal(std::uint32_t number) { return fmt::format("0x{:08x}", number); }

/// Name of an exception (ARMv7-M B1.5.2).
std::string exception_name(std::uint16_t number) {
    switch (number) {
        case 2:
            return "NMI";
        case 3:
            return "HardFault";
        case 4:
            return "MemManage";
        case 5:
            return "BusFault";
        case 6:
            return "UsageFault";
        default:
            return number < 16 ? fmt::format("exception {}", number) : fmt::format("interrupt {}", number - 16);
    }
}

/// Null without a program error. Numbers that are not known are null.
Json crash_json(const protocol::ConditionMessage& m) {
    if (m.crash == 0) {
        return nullptr;
    }
    const auto known = [](std::uint32_t number) { return number == 0 ? Json(nullptr) : Json(hexadecimal(number)); };
    return {{"reason", kCrashes[m.crash]},
            {"count", m.crashes},
            {"exception", m.exception == 0 ? Json(nullptr) : Json(exception_name(m.exception))},
            {"pc", known(m.pc)},
            {"lr", known(m.lr)},
            {"cfsr", hexadecimal(m.cfsr)},
            {"address", known(m.address)}};
}

/// Level 0 to 2; null: not known.
Json read_protection(std::uint16_t settings) {
    if ((settings & kChecked) == 0) {
        return nullptr;
    }
    return (settings & kReadoutTwo) != 0 ? 2 : (settings & kReadoutOne) != 0 ? 1 : 0;
}

}  // namespace

Json condition_json(const protocol::ConditionMessage& m) {
    return {{"reset_reason", kResetReasons[m.reset_reason]},
            {"crash", crash_json(m)},
            {"image", kImages[m.image]},
            {"image_crc", hexadecimal(m.image_crc)},
            {"options", (m.settings & kChecked) != 0 ? Json(hexadecimal(m.options)) : Json(nullptr)},
            {"read_protection", read_protection(m.settings)},
            {"permission_s", m.permission_s == 255 ? Json("always") : Json(m.permission_s)}};
}

Json supply_json(const protocol::StatusMessage& m) {
    const bool is_known = m.supply_mv != 0;
    return {{"supply_v", is_known ? Json(m.supply_mv / 1e3) : Json(nullptr)},
            {"temperature_c", is_known ? Json(m.temperature_cdeg / 1e2) : Json(nullptr)}};
}

std::string crash_text(const Json& crash) {
    if (crash.is_null()) {
        return "none since power-on";
    }
    std::string text = crash["reason"].get<std::string>();
    for (const char* const key : {"exception", "pc", "lr", "address"}) {
        text += crash[key].is_null() ? "" : fmt::format(", {} {}", key, crash[key].get<std::string>());
    }
    text += fmt::format(", cfsr {}", crash["cfsr"].get<std::string>());
    return text + (crash["count"] == 1 ? "" : fmt::format("; the last of {} since power-on", crash["count"].get<int>()));
}

std::vector<std::string> condition_warnings(const protocol::ConditionMessage& m) {
    std::vector<std::string> warnings;
    if (m.crash != 0) {
        warnings.push_back(m.pc == 0 ? "a program error restarted the device; report the line 'crash'"
                                     : fmt::format("a program error restarted the device; to find its source line, run "
                                                   "arm-none-eabi-addr2line -fe tricoil_board.elf {}, then report it",
                                                   hexadecimal(m.pc)));
    }
    if (m.image == kDamaged) {
        warnings.emplace_back("the image is damaged, the coils stay off; write it again with toolchain/flash");
    }
    for (const auto& [bit, problem, option] : kSettings) {
        if ((m.settings & bit) != 0) {
            warnings.push_back(problem +
                               (option == nullptr
                                    ? std::string()
                                    : fmt::format("; to correct it, run STM32_Programmer_CLI -c port=SWD -ob {}", option)));
        }
    }
    return warnings;
}

}  // namespace tricoil::host
