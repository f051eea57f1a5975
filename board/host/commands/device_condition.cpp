#include "board/host/commands/device_condition.hpp"

#include <fmt/format.h>

#include <array>

namespace tricoil::host {
namespace {

constexpr std::array<const char*, 5> kResetReasons{"power-on", "reset pin", "software", "watchdog", "program error"};
constexpr std::array<const char*, 5> kCrashes{"none", "processor fault", "assertion", "watchdog", "stack overflow"};

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

}  // namespace

Json condition_json(const protocol::ConditionMessage& m) {
    return {{"reset_reason", kResetReasons[m.reset_reason]},
            {"crash", crash_json(m)},
            {"permission_s", m.permission_s == 255 ? Json("always") : Json(m.permission_s)}};
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
        warnings.push_back(m.pc == 0
                               ? "a program error restarted the device; report the line 'crash'"
                               : fmt::format("a program error restarted the device; for its place run arm-none-eabi-addr2line "
                                             "-fe tricoil_board.elf {}, then report it",
                                             hexadecimal(m.pc)));
    }
    return warnings;
}

}  // namespace tricoil::host
