#include "board/virtual_board/board_fault_text.hpp"

#include <algorithm>
#include <string_view>

#include "board/support/nearest_name.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr unsigned kMaxNumber = 1'000'000'000;  // larger than any count in a run

/// The number N of the fault; 0 for a fault without a number.
unsigned number_of(const BoardFaultKind& kind, const std::vector<std::string>& arguments, const std::string& fault) {
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
    for (const BoardFaultKind& kind : board_fault_kinds()) {
        all.emplace_back(kind.name);
    }
    return all;
}

bool is_board_fault(const std::string& text) {
    const std::string name = text.substr(0, text.find_first_of(":@"));
    return std::ranges::any_of(board_fault_kinds(), [&](const BoardFaultKind& kind) { return name == kind.name; });
}

BoardFault parse_board_fault(const std::string& text) {
    const host::FaultWords words = host::split_fault(text);
    const BoardFaultKind& kind = board_fault_kinds()[host::index_of_name("fault", words.name, board_fault_names())];
    const BoardFault fault{&kind, number_of(kind, words.arguments, text), words.begin_s, words.end_s};
    const bool converter = fault.number == 1 || (fault.number >= 3 && fault.number <= 5);
    if (words.name == "adc_silent" && !converter) {
        host::refuse_fault(text, "the board uses converters 1, 3, 4 and 5; give one of them");
    }
    return fault;
}

}  // namespace tricoil::virtual_board
