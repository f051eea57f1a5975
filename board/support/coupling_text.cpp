#include "board/support/coupling_text.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>

#include "board/support/errors.hpp"

namespace tricoil::host {

std::string matrix_text(const Mat3<double>& matrix) {
    std::string text;
    for (Eigen::Index k = 0; k < matrix.size(); ++k) {
        text += fmt::format("{}{:.10g}", k > 0 ? "," : "", matrix(k / 3, k % 3));
    }
    return text;
}

namespace {

Mat3<double> parse_matrix(std::span<const std::string_view> fields, const TextPlace& place) {
    Mat3<double> matrix;
    for (std::size_t k = 0; k < fields.size(); ++k) {
        matrix(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) = parse_number(fields[k], place);
    }
    return matrix;
}

}  // namespace

CouplingFrame parse_couplings(std::span<const std::string_view> fields, const TextPlace& place) {
    CouplingFrame couplings{parse_matrix(fields.first(kCouplings), place)};
    if (fields.size() > kCouplings) {
        couplings.quadrature = parse_matrix(fields.last(kCouplings), place);
    }
    return couplings;
}

void check_couplings(const CouplingFrame& couplings, const TextPlace& place) {
    using Complex = std::complex<double>;
    const Mat3<double> quadrature = couplings.quadrature.value_or(Mat3<double>::Zero());
    const Mat3<Complex> x = couplings.x.cast<Complex>() + Complex(0, 1) * quadrature.cast<Complex>();
    if (!(std::abs(x.determinant()) > 1e-6 * std::pow(x.norm(), 3))) {
        throw InputError(place.str() +
                         ": the couplings are zero or have rank below three: a coil or a channel was dead; remove the line");
    }
}

}  // namespace tricoil::host
