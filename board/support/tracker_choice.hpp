// The trackers that a person chooses from, by name.
#pragma once

#include <string>
#include <vector>

#include "board/support/nearest_name.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

inline const std::vector<std::string> kTrackerNames{"direct", "previous", "previous-angles", "scaat"};

/// The method that --tracker names, with its default parameters. Throws InputError for an unknown name.
inline tracking::MethodParams<double> method_of_name(const std::string& typed) {
    using Form = tracking::PreviousParams::Form;
    switch (index_of_name("--tracker", typed, kTrackerNames)) {
        case 0:
            return tracking::DirectParams{};
        case 1:
            return tracking::PreviousParams{Form::vectors};
        case 2:
            return tracking::PreviousParams{Form::angles};
        default:
            return tracking::ScaatParams<double>{};
    }
}

inline const std::string& name_of_method(const tracking::MethodParams<double>& method) {
    const auto* previous = std::get_if<tracking::PreviousParams>(&method);
    const bool angles = previous != nullptr && previous->form == tracking::PreviousParams::Form::angles;
    return kTrackerNames[angles || method.index() == 2 ? method.index() + 1 : method.index()];
}

/// The direct method deskews where columns come in turn.
inline void deskew_in_turn(tracking::TrackerParams<double>& params) {
    if (auto* direct = std::get_if<tracking::DirectParams>(&params.method)) {
        direct->deskew = params.common.max_column_span.count() > 0;
    }
}

}  // namespace tricoil::host
