#include "board/virtual_board/register_list.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "sim/virtual_board/board.hpp"

namespace tricoil::virtual_board {
namespace {

/// Any image that the board accepts: a stack pointer and a reset vector.
std::vector<std::uint8_t> smallest_image() {
    std::vector<std::uint8_t> image(256, 0);
    image[3] = 0x20;  // 0x20000100
    image[1] = 0x01;
    image[4] = 0x81;  // 0x08000081
    image[7] = 0x08;
    return image;
}

}  // namespace

std::string register_list(const sim::Scenario& scenario) {
    VirtualBoard board(smallest_image(), scenario);
    std::vector<Mapping> mappings = board.machine.bus.mappings();
    std::sort(mappings.begin(), mappings.end(), [](const Mapping& a, const Mapping& b) { return a.base < b.base; });
    std::string text =
        "| peripheral | register | address | reset | modelled bits | refused fields |\n|---|---|---|---|---|---|\n";
    for (const Mapping& mapping : mappings) {
        for (const Register& r : mapping.device->registers()) {
            text += fmt::format("| {} | {} | {:#010x} | {:#010x} | {:#010x} | {} |\n", mapping.name, r.name,
                                mapping.base + r.offset, r.reset, r.modelled, r.others);
        }
    }
    return text;
}

}  // namespace tricoil::virtual_board
