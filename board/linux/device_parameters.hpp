// Parameters of a tracker board as TOML.
#pragma once

#include <span>
#include <string>

#include "core/protocol/parameters.hpp"

namespace tricoil::linux_board {

std::string parameters_toml(const protocol::ParameterValues& values);
/// Of words KEY=VALUE, one a line.
std::string parameters_toml(std::span<const std::string> words);

/// `values` with the keys of a text; throws InputError like parse_device_config(), and, if `is_whole`, for a missing key.
protocol::ParameterValues parameters_of(const std::string& file, const std::string& text, protocol::ParameterValues values,
                                        bool is_whole);

}  // namespace tricoil::linux_board
