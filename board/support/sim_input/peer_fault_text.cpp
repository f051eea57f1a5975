#include "board/support/sim_input/peer_fault_text.hpp"

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

std::uint32_t message_number(const std::string& text, const std::string& whole) {
    if (const auto value = number_from<std::uint32_t>(text)) {
        return *value;
    }
    throw InputError("fault '" + whole + "': '" + text + "' is not a message number; write NAME@FIRST-LAST");
}

}  // namespace

sim::PeerFault parse_peer_fault(const std::string& text) {
    const auto at = text.find('@');
    refuse_if(at == std::string::npos, "fault '{}' has no message numbers; write NAME@FIRST-LAST", text);
    sim::PeerFault fault;
    fault.kind = static_cast<sim::PeerFaultKind>(
        index_of_name("fault", text.substr(0, at),
                      {"drop", "swap", "twice", "truncate", "corrupt", "version", "type", "transition", "wrong_sequence",
                       "wrong_coil", "silence", "second_device"}));
    const std::string place = text.substr(at + 1);
    const auto dash = place.find('-');
    fault.first = message_number(place.substr(0, dash), text);
    fault.last = dash == std::string::npos ? fault.first : message_number(place.substr(dash + 1), text);
    return fault;
}

}  // namespace tricoil::host
