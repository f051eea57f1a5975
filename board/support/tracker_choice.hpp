// Names of the trackers and of the kinds of multiplexing for options and configuration files.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"
#include "core/fixed/tracker.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// A method with its default parameters.
struct NamedMethod {
    std::string_view name;
    tracking::MethodParams<double> params;
};

inline constexpr std::array kMethods{
    NamedMethod{"direct", tracking::DirectParams{}},
    NamedMethod{"previous", tracking::PreviousParams{}},
    NamedMethod{"scaat", tracking::ScaatParams<double>{}},
    NamedMethod{"dual-band", tracking::DualBandParams{}},
};

template <typename... Params>
consteval bool have_names(const std::variant<Params...>&) {
    const auto has_name = []<typename P>(const P*) {
        return std::any_of(kMethods.begin(), kMethods.end(), [](const auto& m) { return std::holds_alternative<P>(m.params); });
    };
    return (has_name(static_cast<const Params*>(nullptr)) && ...);
}
static_assert(have_names(tracking::MethodParams<double>{}), "kMethods must contain every method");

inline std::vector<std::string> names_of_methods() {
    std::vector<std::string> names;
    std::transform(kMethods.begin(), kMethods.end(), std::back_inserter(names),
                   [](const auto& m) { return std::string(m.name); });
    return names;
}
inline const std::vector<std::string> kTrackerNames = names_of_methods();

/// Name in a choice of --tracker, which a comma and a key may follow.
inline std::string name_of_choice(const std::string& typed) { return typed.substr(0, typed.find(',')); }

/// Integer trackers, in the order of fixed::Method.
inline const std::vector<std::string> kFixedTrackerNames{"fixed-direct", "fixed-previous"};

/// Method of an integer tracker; empty for any other name.
inline std::optional<fixed::Method> fixed_method(const std::string& typed) {
    const auto found = std::find(kFixedTrackerNames.begin(), kFixedTrackerNames.end(), typed);
    if (found == kFixedTrackerNames.end()) {
        return std::nullopt;
    }
    return static_cast<fixed::Method>(found - kFixedTrackerNames.begin());
}

/// Throws InputError for an integer tracker. Only a simulated run (tricoil run, without a device) supports these trackers.
inline void refuse_fixed_method(const std::string& typed) {
    refuse_if(fixed_method(typed).has_value(),
              "--tracker {}: computes poses from samples, which only tricoil run with a simulated board has; use direct, "
              "previous or scaat for columns",
              typed);
}

/// Throws InputError with the reason for the tracker that needs columns of two bands.
inline void refuse_dual_band(const tracking::MethodParams<double>& method, const std::string& reason) {
    refuse_if(std::holds_alternative<tracking::DualBandParams>(method), "--tracker dual-band: {}", reason);
}

/// Longest prediction. Hands and fast motions are then 20 to 30 mm away from it (board/ACCURACY.md).
constexpr double kMaxPredictionS = 0.1;

/// Time of --predict with this tracker. Throws InputError.
inline Microseconds prediction_of_option(const std::string& tracker, double seconds) {
    refuse_if(!(seconds >= 0 && seconds <= kMaxPredictionS), "--predict {}: must be a number of seconds, 0 (no prediction) to {}",
              seconds, kMaxPredictionS);
    const std::string name = name_of_choice(tracker);
    refuse_if(seconds > 0 && name != "scaat" && name != "dual-band",
              "--predict: --tracker {} estimates no velocity; use --tracker scaat or dual-band", tracker);
    return microseconds_from_seconds(seconds);
}

/// True for the methods with a filter.
inline bool estimates_velocity(const tracking::MethodParams<double>& method) {
    return std::visit(
        [](const auto& params) {
            return requires { params.predict_ahead; };
        },
        method);
}

/// Poses are delivered by this time ahead, from a filter. Throws InputError if the method has no filter.
inline void set_prediction(tracking::MethodParams<double>& method, Microseconds ahead) {
    const auto set = [&](auto& params) {
        if constexpr (requires { params.predict_ahead; }) {
            params.predict_ahead = ahead;
        } else {
            throw InputError("--tracker: predict_s: only with scaat or dual-band, which estimate a velocity");
        }
        if constexpr (requires { params.filter; }) {
            params.filter = true;
        }
    };
    std::visit(set, method);
}

/// Method named by --tracker, with default parameters; `scaat,predict_s=SECONDS`: with prediction; `dual-band,predict_s=SECONDS`:
/// with a filter and prediction. Throws InputError for an unknown name.
inline tracking::MethodParams<double> method_of_name(const std::string& typed) {
    const std::string name = name_of_choice(typed);
    refuse_fixed_method(name);
    std::vector<std::string> names = kTrackerNames;
    names.insert(names.end(), kFixedTrackerNames.begin(), kFixedTrackerNames.end());
    tracking::MethodParams<double> method = kMethods[index_of_name("--tracker", name, names)].params;
    if (const std::string behind = typed.substr(name.size()); !behind.empty()) {
        constexpr std::string_view kKey = ",predict_s=";
        const double seconds = behind.starts_with(kKey) ? number_from<double>(behind.substr(kKey.size())).value_or(-1) : -1;
        refuse_if(!(seconds >= 0 && seconds <= kMaxPredictionS),
                  "--tracker {}: only predict_s=SECONDS may follow the name, 0 (no prediction) to 0.1", typed);
        set_prediction(method, microseconds_from_seconds(seconds));
    }
    return method;
}

inline std::string name_of_method(const tracking::MethodParams<double>& method) {
    const auto is_it = [&](const NamedMethod& named) { return named.params.index() == method.index(); };
    return std::string(std::find_if(kMethods.begin(), kMethods.end(), is_it)->name);
}

/// Sets deskew of a method that solves signal matrices; no effect on the filter.
inline void set_deskew(tracking::MethodParams<double>& method, bool deskew) {
    const auto set = [&](auto& params) {
        if constexpr (requires { params.deskew; }) {
            params.deskew = deskew;
        }
    };
    std::visit(set, method);
}

/// Enables deskew if the columns have different times.
inline void deskew_in_turn(tracking::TrackerParams<double>& params) {
    set_deskew(params.method, params.common.max_column_span.count() > 0);
}

/// In the order of signal::Multiplexing.
inline const std::vector<std::string> kMultiplexingNames{"tdm", "fdm", "dual-band"};

/// Value of --mux. Throws InputError for an unknown name.
inline signal::Multiplexing multiplexing_of_name(std::string_view typed) {
    return static_cast<signal::Multiplexing>(index_of_name("--mux", typed, kMultiplexingNames));
}

}  // namespace tricoil::host
