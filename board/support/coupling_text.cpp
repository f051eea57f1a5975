#include "board/support/coupling_text.hpp"

#include <cmath>

#include "board/support/errors.hpp"

namespace tricoil::host {

Mat3<double> parse_couplings(std::span<const std::string_view> fields, const TextPlace& place) {
    Mat3<double> x;
    for (std::size_t k = 0; k < fields.size(); ++k) {
        x(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) = parse_number(fields[k], place);
    }
    if (!(std::abs(x.determinant()) > 1e-6 * std::pow(x.norm(), 3))) {
        throw InputError(place.str() + ": the couplings are zero or have rank below three: a coil or a channel was dead");
    }
    return x;
}

}  // namespace tricoil::host
