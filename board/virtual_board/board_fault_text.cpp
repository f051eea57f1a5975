#include "board/virtual_board/board_fault_text.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "board/support/nearest_name.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/text_table.hpp"

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
constexpr unsigned kMaxNumber = 1'000'000'000;  // larger than any count in a run

/// The number N of the fault; 0 for a fault without a number.
unsigned number_of(const Kind& kind, const std::vector<std::string>& arguments, const std::string& fault) {
    if (!std::string_view(kind.help).starts_with(std::string(kind.name) + ":N")) {
        if (!arguments.empty()) {
            host::refuse_fault(fault, "this fault takes no number");
        }
        return 0;
    }
    const std::string text = arguments.size() == 1 ? arguments[0] : "";
    const bool is_word = std::string_view(kind.name) == "option_bytes";
    const bool is_hexadecimal = is_word && text.starts_with("0x");
    const auto value =
        host::number_from<unsigned>(std::string_view(text).substr(is_hexadecimal ? 2 : 0), is_hexadecimal ? 16 : 10);
    if (!value && is_word) {
        host::refuse_fault(fault, "give a 32-bit number, for example 0xFFEFF8AA");
    }
    if (!value || (!is_word && (*value < 1 || *value > kMaxNumber))) {
        host::refuse_fault(fault, "give a whole number from 1 to 1000000000");
    }
    return *value;
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
    const host::FaultWords words = host::split_fault(text);
    const Kind& kind = kKinds.at(host::index_of_name("fault", words.name, board_fault_names()));
    const BoardFault fault{kind.name, number_of(kind, words.arguments, text), words.begin_s, words.end_s};
    const bool converter = fault.number == 1 || (fault.number >= 3 && fault.number <= 5);
    if (fault.name == "adc_silent" && !converter) {
        host::refuse_fault(text, "the board uses converters 1, 3, 4 and 5; give one of them");
    }
    return fault;
}

}  // namespace tricoil::virtual_board
