// Reads metal objects: from the arguments of a fault or from a table of a scenario file.
#pragma once

#include <string>
#include <vector>

#include "board/support/checked_table.hpp"
#include "sim/world/metal/object.hpp"

namespace tricoil::host {

/// Reads the keys of a metal object (README.md). Throws InputError for a key that is unknown, missing or out of range.
sim::MetalObject read_metal(CheckedTable& table);

/// Arguments of a fault: SHAPE,KEY=VALUE,... with the keys of read_metal() and the numbers of a vector separated by '/'; or
/// X,Y,Z,RADIUS in metres, which is an aluminium sphere at rest. `text`: the whole fault for messages. Throws InputError.
sim::MetalObject parse_metal(const std::vector<std::string>& arguments, const std::string& text);

}  // namespace tricoil::host
