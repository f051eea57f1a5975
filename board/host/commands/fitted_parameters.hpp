// Parameters of a calibration in the output of commands.
#pragma once

#include <string>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

inline Json parameters_json(const CalibrationFit& fit) {
    Json list = Json::array();
    for (const FittedParameter& p : fit.parameters) {
        list.push_back({{"name", p.name}, {"value", p.value}, {"deviation", p.deviation}});
    }
    return list;
}

inline std::string parameters_text(const Json& list) {
    std::string text;
    for (const Json& p : list) {
        text += fill(p, "  {name:<24} {value:>12.6f} +- {deviation:.6f}\n");
    }
    return text;
}

}  // namespace tricoil::host
