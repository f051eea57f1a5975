#include "sim/world/fault.hpp"

#include <algorithm>

#include "sim/io/input_error.hpp"
#include "sim/io/nearest_name.hpp"
#include "sim/io/text_table.hpp"

namespace tricoil::sim {
namespace {

constexpr double kRunawayCurrent = 4;

[[noreturn]] void complain(const std::string& text, const std::string& what) {
    throw InputError("fault '" + text + "': " + what);
}

double number(const std::string& field, const std::string& text) {
    try {
        const std::string where = "fault";
        return parse_number(field, {where, 1});
    } catch (const InputError&) {
        complain(text, "'" + field + "' is not a number");
    }
}

/// 0-2 for the coil named by `prefix` and 1-3.
int coil(const std::string& name, char prefix) {
    return name.size() == 2 && name[0] == prefix && name[1] >= '1' && name[1] <= '3' ? name[1] - '1' : -1;
}

bool is_coil(const std::string& name) { return coil(name, 'S') >= 0 || coil(name, 'C') >= 0; }

int channel(const std::string& name) { return name == "R" ? 3 : coil(name, 'C'); }

void check_arguments(const Fault& fault, const std::string& text) {
    const auto& a = fault.arguments;
    const auto need = [&](bool ok, const char* what) {
        if (!ok) {
            complain(text, what);
        }
    };
    switch (fault.kind) {
        case FaultKind::open_coil:
        case FaultKind::broken_stage:
            return need(a.size() == 1 && coil(a[0], 'S') >= 0, "name one source coil, S1 to S3");
        case FaultKind::reversed_coil:
            return need(a.size() == 1 && is_coil(a[0]), "name one coil, S1 to S3 or C1 to C3");
        case FaultKind::swapped_coils:
            return need(a.size() == 2 && is_coil(a[0]) && is_coil(a[1]) && a[0][0] == a[1][0] && a[0] != a[1],
                        "name two coils of one triad, as S1,S2 or C1,C3");
        case FaultKind::stuck_channel:
            return need(a.size() == 1 && channel(a[0]) >= 0, "name one channel, C1 to C3 or R");
        case FaultKind::dropped_blocks:
            return need(a.size() == 1 && number(a[0], text) >= 0 && number(a[0], text) <= 1, "give the share lost, 0 to 1");
        case FaultKind::metal:
            need(a.size() == 4, "give x,y,z,radius in metres");
            std::for_each(a.begin(), a.end(), [&](const std::string& field) { number(field, text); });
            return need(number(a[3], text) > 0, "the radius must be positive");
        case FaultKind::unplugged:
            return need(a.empty(), "takes no argument");
        case FaultKind::overload:
            return need(a.size() == 1 && number(a[0], text) > 0, "give its amplitude in converter ranges, above 0");
    }
}

void apply(const Fault& fault, FaultEffect& effect) {
    const auto& a = fault.arguments;
    const auto value = [&](std::size_t i) { return number(a[i], ""); };
    const auto triad = [&]() -> Mat3<double>& { return a[0][0] == 'S' ? effect.source : effect.sensor; };
    const auto index = [&](std::size_t i) { return static_cast<Eigen::Index>(a[i][1] - '1'); };
    switch (fault.kind) {
        case FaultKind::open_coil:
            effect.current(index(0)) = 0;
            break;
        case FaultKind::broken_stage:
            effect.current(index(0)) = kRunawayCurrent;
            break;
        case FaultKind::reversed_coil:
            triad().col(index(0)) *= -1;
            break;
        case FaultKind::swapped_coils:
            triad().col(index(0)).swap(triad().col(index(1)));
            break;
        case FaultKind::stuck_channel:
            effect.stuck[static_cast<std::size_t>(channel(a[0]))] = true;
            break;
        case FaultKind::dropped_blocks:
            effect.drop_share = value(0);
            break;
        case FaultKind::metal:
            effect.metal = true;
            effect.metal_position_m << value(0), value(1), value(2);
            effect.metal_radius_m = value(3);
            break;
        case FaultKind::unplugged:
            effect.unplugged = true;
            break;
        case FaultKind::overload:
            effect.overload_ranges += value(0);
            break;
    }
}

}  // namespace

const std::vector<std::string>& fault_names() {
    static const std::vector<std::string> names{"open_coil", "reversed_coil", "swapped_coils", "stuck_channel", "dropped_blocks",
                                                "metal",     "unplugged",     "overload",      "broken_stage"};
    return names;
}

Fault parse_fault(const std::string& text) {
    const auto at = text.find('@');
    const std::string head = text.substr(0, at);
    const auto colon = head.find(':');
    Fault fault;
    fault.kind = static_cast<FaultKind>(index_of_name("fault", head.substr(0, colon), fault_names()));
    if (colon != std::string::npos) {
        for (const auto field : split(std::string_view(head).substr(colon + 1), ',')) {
            fault.arguments.emplace_back(field);
        }
    }
    check_arguments(fault, text);
    if (at != std::string::npos) {
        const std::string window = text.substr(at + 1);
        const auto dash = window.find('-', 1);
        fault.begin_s = number(window.substr(0, dash), text);
        if (dash != std::string::npos) {
            fault.end_s = number(window.substr(dash + 1), text);
        }
        if (!(fault.begin_s >= 0) || !(fault.end_s > fault.begin_s)) {
            complain(text, "times must be BEGIN-END in seconds, in order");
        }
    }
    return fault;
}

FaultEffect effect_at(const std::vector<Fault>& faults, double time_s) {
    FaultEffect effect;
    for (const Fault& fault : faults) {
        if (time_s >= fault.begin_s && time_s < fault.end_s) {
            apply(fault, effect);
        }
    }
    return effect;
}

}  // namespace tricoil::sim
