// The latest column of each state, as one signal matrix when the three are recent enough.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "core/signal/column.hpp"

namespace tricoil::tracking {

/// X of (6) with what the solver needs to know about it.
template <typename Scalar>
struct SignalMatrix {
    Mat3<Scalar> x;
    Scalar sigma = 0;   // root mean square of the nine entries' noise
    ColumnFlags flags;  // of all three columns
    DeviceTime newest{};
    Vec3<Scalar> column_age_s = Vec3<Scalar>::Zero();  // of each column against the newest
};

template <typename Scalar>
class SignalMatrixAssembler {
public:
    /// max_span: longest time between the oldest and the newest column of one matrix. Zero asks for simultaneous columns (FDM).
    explicit SignalMatrixAssembler(Microseconds max_span) : max_span_(max_span) {}

    /// Takes a column of state s1-s3; the matrix if it is complete with it.
    std::optional<SignalMatrix<Scalar>> add(const Column<Scalar>& column) {
        columns_[static_cast<std::size_t>(coil_index(column.state))] = column;
        const auto by_time = [](const auto& a, const auto& b) { return a.midpoint < b.midpoint; };
        const auto [oldest, newest] = std::minmax_element(columns_.begin(), columns_.end(), by_time);
        const bool complete =
            std::none_of(columns_.begin(), columns_.end(), [](const auto& c) { return c.state == Excitation::off; });
        if (!complete || newest->midpoint - oldest->midpoint > max_span_) {
            return std::nullopt;
        }
        SignalMatrix<Scalar> matrix;
        Scalar variance = 0;
        for (std::size_t j = 0; j < kSourceCoils; ++j) {
            matrix.x.col(static_cast<Eigen::Index>(j)) = columns_[j].in_phase;
            matrix.flags |= columns_[j].flags;
            variance += columns_[j].sigma.squaredNorm();
            matrix.column_age_s(static_cast<Eigen::Index>(j)) = seconds_as<Scalar>(newest->midpoint - columns_[j].midpoint);
        }
        matrix.sigma = std::sqrt(variance / 9);
        matrix.newest = newest->midpoint;
        return matrix;
    }

private:
    Microseconds max_span_;
    std::array<Column<Scalar>, kSourceCoils> columns_{};
};

}  // namespace tricoil::tracking
