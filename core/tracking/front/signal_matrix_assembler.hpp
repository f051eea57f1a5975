// Assembler of signal matrices: the latest column of each excitation state, if the three are close enough in time.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "core/tracking/front/deskew.hpp"

namespace tricoil::tracking {

/// X of (6) with noise, flags and times.
template <typename Scalar>
struct SignalMatrix {
    Mat3<Scalar> x;
    Scalar sigma = 0;                // root mean square of the nine entries' noise
    Scalar quadrature_squared = 0;   // sum of the nine, not extrapolated
    Scalar quadrature_variance = 0;  // mean variance of the nine quadratures' noise
    ColumnFlags flags;               // of all three columns
    DeviceTime newest{};
    Vec3<Scalar> column_age_s = Vec3<Scalar>::Zero();  // age of each column's values in x relative to the newest column
};

template <typename Scalar>
class SignalMatrixAssembler {
public:
    /// max_span: longest time between the oldest and the newest column of one matrix. Zero: only simultaneous columns (FDM).
    /// deskew: extrapolate each column to the time of the newest; no effect on simultaneous columns.
    explicit SignalMatrixAssembler(Microseconds max_span, bool deskew = false) : max_span_(max_span), deskew_(deskew) {}

    /// Adds a column of state s1-s3. Returns the matrix if this column completes it. Ignores a column older than the stored one.
    std::optional<SignalMatrix<Scalar>> add(const Column<Scalar>& column) {
        return note(column) ? std::optional(matrix()) : std::nullopt;
    }

    /// add() without the matrix: true if matrix() is complete.
    bool note(const Column<Scalar>& column) {
        const auto index = static_cast<std::size_t>(coil_index(column.state));
        if (columns_[index].state != Excitation::off && column.midpoint < columns_[index].midpoint) {
            return false;
        }
        before_[index] = columns_[index];
        columns_[index] = column;
        const auto [oldest, newest] = std::minmax_element(columns_.begin(), columns_.end(), kByTime);
        const bool complete =
            std::none_of(columns_.begin(), columns_.end(), [](const auto& c) { return c.state == Excitation::off; });
        return complete && newest->midpoint - oldest->midpoint <= max_span_;
    }

    /// The matrix of the latest columns, after note() returned true.
    [[nodiscard]] SignalMatrix<Scalar> matrix() const {
        SignalMatrix<Scalar> matrix;
        matrix.newest = std::max_element(columns_.begin(), columns_.end(), kByTime)->midpoint;
        // Two spans: columns of one state are one frame apart, and a frame is one slot longer than the span of its columns.
        const Microseconds longest_gap = deskew_ ? 2 * max_span_ : Microseconds{0};
        Scalar variance = 0;
        for (std::size_t j = 0; j < kSourceCoils; ++j) {
            const auto column = deskew<Scalar>(before_[j], columns_[j], matrix.newest, longest_gap);
            matrix.x.col(static_cast<Index>(j)) = column.in_phase;
            matrix.flags |= columns_[j].flags;
            if (column.variance_factor != Scalar(1)) {  // extrapolated from the previous column
                matrix.flags |= before_[j].flags;
            }
            matrix.quadrature_squared += columns_[j].quadrature.squaredNorm();
            matrix.quadrature_variance += columns_[j].sigma.squaredNorm() / 9;
            variance += columns_[j].sigma.squaredNorm() * column.variance_factor;
            matrix.column_age_s(static_cast<Index>(j)) = seconds_as<Scalar>(matrix.newest - column.time);
        }
        matrix.sigma = std::sqrt(variance / 9);
        return matrix;
    }

    /// The latest column of source coil j (0-2); its state is off if there was none.
    [[nodiscard]] const Column<Scalar>& latest(int j) const { return columns_[static_cast<std::size_t>(j)]; }

    void clear() {
        columns_ = {};
        before_ = {};
    }

private:
    static constexpr auto kByTime = [](const auto& a, const auto& b) { return a.midpoint < b.midpoint; };

    Microseconds max_span_;
    bool deskew_;
    std::array<Column<Scalar>, kSourceCoils> columns_{};
    std::array<Column<Scalar>, kSourceCoils> before_{};
};

}  // namespace tricoil::tracking
