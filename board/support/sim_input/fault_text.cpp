#include "board/support/sim_input/fault_text.hpp"

#include <algorithm>
#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/sim_input/metal_text.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

using sim::Fault;
using sim::FaultKind;

double number(const std::string& field, const std::string& text) {
    const auto value = number_from<double>(field);
    if (!value || !std::isfinite(*value)) {
        refuse_fault(text, "'" + field + "' is not a number");
    }
    return *value;
}

/// 0-2 for a coil name that consists of `prefix` and 1-3; -1 for any other name.
int coil(const std::string& name, char prefix) {
    return name.size() == 2 && name[0] == prefix && name[1] >= '1' && name[1] <= '3' ? name[1] - '1' : -1;
}

bool is_coil(const std::string& name) { return coil(name, 'S') >= 0 || coil(name, 'C') >= 0; }

int channel(const std::string& name) { return name == "R" ? 3 : coil(name, 'C'); }

bool are_coils_of_one_triad(const std::vector<std::string>& names) {
    return std::all_of(names.begin(), names.end(), [&](const auto& name) { return is_coil(name) && name[0] == names[0][0]; });
}

/// Stores the named coils.
void take_coils(const std::vector<std::string>& names, Fault& fault) {
    fault.triad = names[0][0] == 'S' ? sim::Triad::source : sim::Triad::sensor;
    for (std::size_t i = 0; i < names.size(); ++i) {
        fault.coils[i] = coil(names[i], names[i][0]);
    }
}

void take_arguments(const std::vector<std::string>& a, const std::string& text, Fault& fault) {
    const auto need = [&](bool ok, const char* what) {
        if (!ok) {
            refuse_fault(text, what);
        }
    };
    switch (fault.kind) {
        case FaultKind::open_coil:
        case FaultKind::broken_stage:
            need(a.size() == 1 && coil(a[0], 'S') >= 0, "name one source coil, S1 to S3");
            return take_coils(a, fault);
        case FaultKind::reversed_coil:
            need(a.size() == 1 && is_coil(a[0]), "name one coil, S1 to S3 or C1 to C3");
            return take_coils(a, fault);
        case FaultKind::swapped_coils:
            need(a.size() == 2 && are_coils_of_one_triad(a) && a[0] != a[1], "name two coils of one triad, as S1,S2 or C1,C3");
            return take_coils(a, fault);
        case FaultKind::stuck_channel:
            need(a.size() == 1 && channel(a[0]) >= 0, "name one channel, C1 to C3 or R");
            fault.channel = channel(a[0]);
            return;
        case FaultKind::dropped_blocks:
            need(a.size() == 1 && number(a[0], text) >= 0 && number(a[0], text) <= 1, "give the share of lost blocks, 0 to 1");
            fault.number = number(a[0], text);
            return;
        case FaultKind::metal:
            fault.metal = parse_metal(a, text);
            return;
        case FaultKind::unplugged:
            return need(a.empty(), "takes no argument");
        case FaultKind::overload:
            need(a.size() == 1 && number(a[0], text) > 0, "give an amplitude above 0, in converter ranges");
            fault.number = number(a[0], text);
            return;
    }
}

}  // namespace

const std::vector<std::string>& fault_names() {
    static const std::vector<std::string> names{"open_coil", "reversed_coil", "swapped_coils", "stuck_channel", "dropped_blocks",
                                                "metal",     "unplugged",     "overload",      "broken_stage"};
    return names;
}

void refuse_fault(const std::string& text, const std::string& what) { throw InputError("fault '" + text + "': " + what); }

FaultWords split_fault(const std::string& text) {
    const auto at = text.find('@');
    const std::string head = text.substr(0, at);
    const auto colon = head.find(':');
    FaultWords words;
    words.name = head.substr(0, colon);
    if (colon != std::string::npos) {
        for (const auto field : split(std::string_view(head).substr(colon + 1), ',')) {
            words.arguments.emplace_back(field);
        }
    }
    if (at != std::string::npos) {
        const std::string window = text.substr(at + 1);
        const auto dash = window.find('-', 1);
        words.begin_s = number(window.substr(0, dash), text);
        words.end_s = dash == std::string::npos ? words.end_s : number(window.substr(dash + 1), text);
        if (!(words.begin_s >= 0) || !(words.end_s > words.begin_s)) {
            refuse_fault(text, "times must be BEGIN-END in seconds, in order");
        }
    }
    return words;
}

Fault parse_fault(const std::string& text) {
    const FaultWords words = split_fault(text);
    Fault fault;
    fault.kind = static_cast<FaultKind>(index_of_name("fault", words.name, fault_names()));
    take_arguments(words.arguments, text, fault);
    fault.begin_s = words.begin_s;
    fault.end_s = words.end_s;
    return fault;
}

}  // namespace tricoil::host
