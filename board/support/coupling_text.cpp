#include "board/support/coupling_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <complex>

#include "board/support/errors.hpp"
#include "core/signal/gain_step.hpp"

namespace tricoil::host {

std::string matrix_text(const Mat3<double>& matrix) {
    std::string text;
    for (Index k = 0; k < matrix.size(); ++k) {
        text += fmt::format("{}{:.10g}", k > 0 ? "," : "", matrix(k / 3, k % 3));
    }
    return text;
}

namespace {

Mat3<double> parse_matrix(std::span<const std::string_view> fields, const TextPlace& place) {
    Mat3<double> matrix;
    for (std::size_t k = 0; k < fields.size(); ++k) {
        matrix(static_cast<Index>(k / 3), static_cast<Index>(k % 3)) = parse_number(fields[k], place);
    }
    return matrix;
}

SignalLevels parse_levels(std::span<const std::string_view> fields, const TextPlace& place) {
    const double step = parse_number(fields.back(), place);
    refuse_if(!(step >= 0 && step < static_cast<double>(signal::kMaxGainSteps) && step == std::floor(step)),
              "{}: gain_step must be a whole number from 0 to {}", place, signal::kMaxGainSteps - 1);
    const SignalLevels levels{parse_matrix(fields.first(kCouplings), place), static_cast<int>(step)};
    refuse_if(!(levels.share.minCoeff() >= 0 && levels.share.maxCoeff() <= 1),
              "{}: a level (a11 to a33) is not a share of full scale, 0 to 1", place);
    return levels;
}

}  // namespace

std::size_t take_coupling_fields(std::string_view& header) {
    std::size_t fields = kCouplings;
    const auto take = [&](std::string_view columns, std::size_t count) {
        const bool has = header.ends_with(columns);
        header.remove_suffix(has ? columns.size() : 0);
        fields += has ? count : 0;
    };
    take(kLevelColumns, kCouplings + 1);
    take(kQuadratureColumns, kCouplings);
    return fields;
}

CouplingFrame parse_couplings(std::span<const std::string_view> fields, const TextPlace& place) {
    CouplingFrame couplings{parse_matrix(fields.first(kCouplings), place)};
    fields = fields.subspan(kCouplings);
    if (fields.size() == kCouplings || fields.size() > kCouplings + 1) {
        couplings.quadrature = parse_matrix(fields.first(kCouplings), place);
        fields = fields.subspan(kCouplings);
    }
    if (!fields.empty()) {
        couplings.levels = parse_levels(fields, place);
    }
    return couplings;
}

void check_couplings(const CouplingFrame& couplings, const TextPlace& place) {
    using Complex = std::complex<double>;
    const Mat3<double> quadrature = couplings.quadrature.value_or(Mat3<double>::Zero());
    const Mat3<Complex> x = couplings.x.cast<Complex>() + Complex(0, 1) * quadrature.cast<Complex>();
    refuse_if(!(std::abs(x.determinant()) > 1e-6 * std::pow(std::hypot(couplings.x.norm(), quadrature.norm()), 3)),
              "{}: the couplings are zero or have rank below three: a coil or a channel was dead; remove the line", place);
}

}  // namespace tricoil::host
