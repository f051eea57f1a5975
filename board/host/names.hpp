// Names that a person types, looked up with a suggestion for a wrong one.
#pragma once

#include "sim/io/nearest_name.hpp"

namespace tricoil::host {

using sim::index_of_name;
using sim::nearest_name;

}  // namespace tricoil::host
