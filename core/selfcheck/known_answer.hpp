// Comparison of a result with its known answer, and limits in units of the precision.
#pragma once

#include <limits>

#include "core/linear/matrix.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::selfcheck {

/// Error of a missing result.
constexpr double kInfinite = std::numeric_limits<double>::infinity();

template <typename Scalar>
constexpr Precision precision_of() {
    return sizeof(Scalar) == sizeof(float) ? Precision::single : Precision::f64;
}

/// `count` rounding errors at magnitude one.
template <typename Scalar>
constexpr double roundings(double count) {
    return count * static_cast<double>(std::numeric_limits<Scalar>::epsilon());
}

/// Largest difference among `count` entries, in the precision of the result; infinite if an entry is NaN.
double worst_difference(const float* result, const double* answer, Index count);
double worst_difference(const double* result, const double* answer, Index count);

template <typename A, typename B>
double worst_difference(const Dense<A>& result, const Dense<B>& answer) {
    const typename A::Plain result_entries = result;
    const Matrix<double, B::kRows, B::kColumns> answer_entries = answer.template cast<double>();
    return worst_difference(result_entries.data(), answer_entries.data(), result_entries.size());
}

template <int Rows, int Columns, typename... Entries>
Matrix<double, Rows, Columns> known(Entries... entries) {
    const double row_by_row[] = {entries...};
    static_assert(sizeof...(Entries) == static_cast<std::size_t>(Rows * Columns));
    Matrix<double, Rows, Columns> m;
    for (int i = 0; i < Rows * Columns; ++i) {
        m(i / Columns, i % Columns) = row_by_row[i];
    }
    return m;
}

}  // namespace tricoil::selfcheck
