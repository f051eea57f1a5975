// Generates the tables that board/nucleo_g474re/HARDWARE.md must contain.
#pragma once

#include <string>
#include <vector>

namespace tricoil::test {

struct HardwareTable {
    std::string name;
    std::string text;  // lines, including line ends
};

std::vector<HardwareTable> hardware_tables();

}  // namespace tricoil::test
