#include "board/support/coupling_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

constexpr std::string_view kExpected =
    "x11,x12,x13,x21,x22,x23,x31,x32,x33 (xij: sensor coil i, source coil j), optionally q11,...,q33 and a11,...,a33,gain_step";

}  // namespace

std::array<std::size_t, kCouplings> matrix_columns(const Table& table, std::string_view form, std::string_view expected) {
    std::array<std::size_t, kCouplings> columns;
    for (std::size_t k = 0; k < kCouplings; ++k) {
        columns[k] = table.column(fmt::format(fmt::runtime(form), k / 3 + 1, k % 3 + 1), expected);
    }
    return columns;
}

Mat3<double> matrix_of(const Table& table, const std::array<std::size_t, kCouplings>& columns) {
    Mat3<double> matrix;
    for (std::size_t k = 0; k < kCouplings; ++k) {
        matrix(static_cast<Index>(k / 3), static_cast<Index>(k % 3)) = table.number(columns[k]);
    }
    return matrix;
}

CouplingColumns::CouplingColumns(const Table& table, const ChannelWiring& wiring)
    : table_(table), x_(matrix_columns(table, table.has("m11") ? "m{}{}" : "x{}{}", kExpected)) {
    refuse_if(wiring != ChannelWiring{} && table.is_of_coils(), "{}: its wiring is corrected already; leave out --wiring",
              table.path());
    const auto has_any = [&](std::string_view form) {
        return std::ranges::any_of(std::array{11, 12, 13, 21, 22, 23, 31, 32, 33},
                                   [&](int entry) { return table.has(fmt::format(fmt::runtime(form), entry)); });
    };
    if (has_any("q{}")) {
        quadrature_ = matrix_columns(table, "q{}{}", kExpected);
    }
    if (has_any("a{}") || table.has("gain_step")) {
        levels_ = matrix_columns(table, "a{}{}", kExpected);
        gain_step_ = table.column("gain_step", kExpected);
    }
}

CouplingFrame CouplingColumns::read() const {
    const CouplingFrame couplings = read_any();
    check_couplings(couplings, table_.place());
    return couplings;
}

CouplingFrame CouplingColumns::read_any() const {
    CouplingFrame couplings{matrix_of(table_, x_)};
    if (quadrature_) {
        couplings.quadrature = matrix_of(table_, *quadrature_);
    }
    if (levels_) {
        const int step = table_.whole(gain_step_, 0, static_cast<int>(signal::kMaxGainSteps) - 1);
        couplings.levels = {matrix_of(table_, *levels_), step};
        const Mat3<double>& share = couplings.levels->share;
        refuse_if(!(share.minCoeff() >= 0 && share.maxCoeff() <= 1),
                  "{}: a level (a11 to a33) is not a share of full scale, 0 to 1", table_.place());
    }
    return couplings;
}

void CouplingFrame::rewire(const ChannelWiring& wiring) {
    x = wiring.of_coils(x);
    if (quadrature) {
        quadrature = wiring.of_coils(*quadrature);
    }
    if (levels) {
        levels->share = wiring.of_coils(levels->share).cwiseAbs();
        for (std::size_t c = 0; c < levels->channel.size(); ++c) {
            levels->channel[static_cast<std::size_t>(wiring.sensor.coil[c])] = static_cast<Index>(c);
        }
    }
}

void check_couplings(const CouplingFrame& couplings, const TextPlace& place) {
    using Complex = std::complex<double>;
    const Mat3<double> quadrature = couplings.quadrature.value_or(Mat3<double>::Zero());
    const Mat3<Complex> x = couplings.x.cast<Complex>() + Complex(0, 1) * quadrature.cast<Complex>();
    refuse_if(!(std::abs(x.determinant()) > 1e-6 * std::pow(std::hypot(couplings.x.norm(), quadrature.norm()), 3)),
              "{}: the couplings are zero or have rank below three: a coil or a channel was dead; remove the line", place);
}

}  // namespace tricoil::host
