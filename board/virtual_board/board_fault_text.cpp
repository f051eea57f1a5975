#include "board/virtual_board/board_fault_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::virtual_board {
namespace {

struct Kind {
    const char* name;
    const char* help;
};
constexpr std::array<Kind, 18> kKinds{{
    {"adc_silent", "adc_silent:N  converter N (1, 3, 4 or 5) never ends a conversion"},
    {"dma_stuck", "dma_stuck  the DMA serves no request: converters overrun, carriers stop"},
    {"crystal", "crystal  the crystal stops, or does not start"},
    {"hang", "hang  the main program stops, interrupts continue"},
    {"hang_masked", "hang_masked  the main program and all interrupts stop"},
    {"bad_access", "bad_access  the program reads an address without memory: a processor fault"},
    {"stack_overflow", "stack_overflow  the program pushes registers until its stack is full"},
    {"code_in_ram", "code_in_ram  the program jumps to RAM"},
    {"power_loss", "power_loss  power off and on again"},
    {"flash_power_loss", "flash_power_loss:N  power is lost within the N-th flash erase or program operation from then on"},
    {"usb_resets", "usb_resets:N  USB bus reset every N milliseconds"},
    {"can_babble", "can_babble  another node sends identifier 0 without pause"},
    {"can_errors", "can_errors:N  the next N frames of the board are destroyed"},
    {"button", "button  the user button B1 is pressed"},
    {"option_bytes", "option_bytes:N  the option bytes are N (FLASH_OPTR), for example 0xFFEFF8AA of the factory"},
    {"chip_temperature", "chip_temperature:N  the chip has N degrees Celsius"},
    {"supply", "supply:N  the chip's voltage reference shows a supply of N millivolts"},
    {"can_alone", "can_alone  no other node on the CAN bus acknowledges"},
}};
constexpr double kMaxNumber = 1e9;  // fits `unsigned`; larger than any count in a run
constexpr double kMaxWord = 4294967295;
constexpr double kAlways = std::numeric_limits<double>::infinity();

double number(const std::string& text, const std::string& fault) {
    try {
        std::size_t used = 0;
        const double value = std::stod(text, &used);
        if (used == text.size() && value >= 0) {
            return value;
        }
    } catch (const std::exception&) {  // reported below
    }
    throw host::InputError("fault '" + fault + "': '" + text + "' is not a number of at least 0");
}

/// The number N of the fault; 0 for a fault without a number.
unsigned count(const Kind& kind, const std::string& field, const std::string& fault) {
    const bool takes_number = std::string_view(kind.help).starts_with(std::string(kind.name) + ":N");
    if (!takes_number) {
        if (!field.empty()) {
            throw host::InputError("fault '" + fault + "': this fault takes no number");
        }
        return 0;
    }
    const double value = number(field.empty() ? field : field.substr(1), fault);
    if (std::string_view(kind.name) == "option_bytes") {
        if (value > kMaxWord || value != std::floor(value)) {
            throw host::InputError("fault '" + fault + "': give a 32-bit number, for example 0xFFEFF8AA");
        }
        return static_cast<unsigned>(value);
    }
    if (value < 1 || value > kMaxNumber || value != std::floor(value)) {
        throw host::InputError("fault '" + fault + "': give a whole number from 1 to 1000000000");
    }
    return static_cast<unsigned>(value);
}

}  // namespace

std::vector<std::string> board_fault_names() {
    std::vector<std::string> all;
    std::transform(kKinds.begin(), kKinds.end(), std::back_inserter(all), [](const Kind& kind) { return kind.name; });
    return all;
}

std::vector<std::string> board_fault_help() {
    std::vector<std::string> all;
    std::transform(kKinds.begin(), kKinds.end(), std::back_inserter(all), [](const Kind& kind) { return kind.help; });
    return all;
}

bool is_board_fault(const std::string& text) {
    const std::string name = text.substr(0, text.find_first_of(":@"));
    return std::any_of(kKinds.begin(), kKinds.end(), [&](const Kind& kind) { return name == kind.name; });
}

BoardFault parse_board_fault(const std::string& text) {
    BoardFault fault;
    const auto at = text.find('@');
    const std::string head = text.substr(0, at);
    const auto colon = head.find(':');
    const Kind& kind = kKinds.at(host::index_of_name("fault", head.substr(0, colon), board_fault_names()));
    fault.name = kind.name;
    fault.number = count(kind, head.substr(std::min(colon, head.size())), text);
    fault.end_s = kAlways;
    if (at != std::string::npos) {
        const std::string times = text.substr(at + 1);
        const auto dash = times.find('-');
        fault.begin_s = number(times.substr(0, dash), text);
        fault.end_s = dash == std::string::npos ? kAlways : number(times.substr(dash + 1), text);
    }
    if (fault.end_s <= fault.begin_s) {
        throw host::InputError("fault '" + text + "': times must be BEGIN-END in seconds, in order");
    }
    const bool converter = fault.number == 1 || (fault.number >= 3 && fault.number <= 5);
    if (fault.name == "adc_silent" && !converter) {
        throw host::InputError("fault '" + text + "': the board uses converters 1, 3, 4 and 5; give one of them");
    }
    return fault;
}

}  // namespace tricoil::virtual_board
