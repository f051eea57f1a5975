// `tricoil calibrate --pivot`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tricoil::host {

/// Calibrates the tip of a pointer, prints the result and writes it to `out`, if not empty. Returns the exit code.
int calibrate_pivot_command(const std::string& path, std::optional<std::uint8_t> sensor, const std::string& out, bool json);

}  // namespace tricoil::host
