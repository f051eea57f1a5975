// Value of an option --hemisphere X,Y,Z.
#pragma once

#include <vector>

#include "board/support/errors.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::host {

/// Throws InputError unless the numbers are a direction.
inline Vec3<double> hemisphere_of(const std::vector<double>& option) {
    const Vec3<double> direction(option.at(0), option.at(1), option.at(2));
    refuse_if(!tracking::is_hemisphere(direction) || direction.isZero(0),
              "--hemisphere must be a direction: three finite numbers, not all zero");
    return direction;
}

}  // namespace tricoil::host
