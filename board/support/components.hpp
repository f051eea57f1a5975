// Optional components of the programs: each is built if its packages were found.
#pragma once

#include <cstdint>
#include <string>

namespace tricoil::host {

/// In the order of toolchain/cmake/Components.cmake. Sources that call the library of a component are compiled with
/// TRICOIL_WITH_CAN and so on.
enum class Component : std::uint8_t { gpio, can, usb, openigtlink, osc, web, calibration, virtual_board };

[[nodiscard]] bool is_built(Component component);

/// Throws InputError if the component is absent. `user`: the option or command that needs it.
void require(Component component, const std::string& user);

}  // namespace tricoil::host
