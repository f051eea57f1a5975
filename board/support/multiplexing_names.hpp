// Names of the kinds of multiplexing for options and reports.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "board/support/nearest_name.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::host {

/// In the order of signal::Multiplexing.
inline const std::vector<std::string> kMultiplexingNames{"tdm", "fdm", "dual-band"};

/// Value of --mux. Throws InputError for an unknown name.
inline signal::Multiplexing multiplexing_of_name(std::string_view typed) {
    return static_cast<signal::Multiplexing>(index_of_name("--mux", typed, kMultiplexingNames));
}

}  // namespace tricoil::host
