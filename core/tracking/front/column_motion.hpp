// Errors of a signal matrix due to motion, from the columns of the last frames.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// First and second time derivative of each column of X from differences of consecutive columns. They give the size of the errors
/// that motion within a window and between columns causes. Without them these errors would be attributed to metal.
template <typename Scalar>
class ColumnMotion {
public:
    explicit ColumnMotion(const CommonParams<Scalar>& params) : max_gap_s_(longest_gap_s(params)) {}

    /// X'' of the last three columns of a coil; zero if they are too few or too far apart.
    struct Curvature {
        Vec3<Scalar> value = Vec3<Scalar>::Zero();  // 1/s^2
        Scalar variance = 0;                        // its noise, per entry
    };

    /// Adds a column, unless it is older than the last of its coil. sigma of the column: noise of its entries, which the second
    /// difference contains as well. Returns the curvature up to this column; nullopt for an older column.
    std::optional<Curvature> add(const Column<Scalar>& column) {
        History& h = histories_[static_cast<std::size_t>(coil_index(column.state))];
        if (h.columns > 0 && column.midpoint < h.time) {
            return std::nullopt;
        }
        const Scalar gap_s = seconds_as<Scalar>(column.midpoint - h.time);
        const bool follows = h.columns > 0 && gap_s > Scalar(kMinGap_s) && gap_s < max_gap_s_;
        const Vec3<Scalar> slope = follows ? Vec3<Scalar>((column.in_phase - h.couplings) / gap_s) : Vec3<Scalar>::Zero();
        const Scalar kept = h.columns > 0 ? Scalar(kMemory_s) / (Scalar(kMemory_s) + std::max(gap_s, Scalar(0))) : Scalar(0);
        h.curvature_squared *= kept;
        Curvature curvature;
        if (follows && h.columns > 1) {
            curvature = second_derivative(h, slope, gap_s, column.sigma.squaredNorm() / 3);
            h.curvature_squared = std::max(h.curvature_squared, significant(curvature.value, curvature.variance));
        }
        h.columns = follows ? std::min(h.columns + 1, 3) : 1;
        h.couplings = column.in_phase;
        h.slope = slope;
        h.slope_squared = follows ? significant(slope, 2 * column.sigma.squaredNorm() / (3 * gap_s * gap_s)) : Scalar(0);
        h.gap_s = gap_s;
        h.time = column.midpoint;
        return curvature;
    }

    /// True if two columns of each coil precede the newest, with gaps within the limits.
    [[nodiscard]] bool known() const {
        return std::all_of(histories_.begin(), histories_.end(), [](const History& h) { return h.columns > 2; });
    }

    /// Mean variance of the nine entries of `matrix`, of the newest columns, due to motion; coupling units squared. A linear
    /// extrapolation by h from two columns g apart has the error h (h + g) X''/2, a column of age h has the error h X', and the
    /// mean over a window of length tau has the error X'' tau^2/24.
    [[nodiscard]] Scalar error_variance(const SignalMatrix<Scalar>& matrix, Scalar window_s) const {
        Scalar sum = 0;
        for (std::size_t j = 0; j < kSourceCoils; ++j) {
            const History& h = histories_[j];
            const Scalar elapsed_s = seconds_as<Scalar>(matrix.newest - h.time);
            const Scalar age_s = matrix.column_age_s(static_cast<Index>(j));
            const Scalar extrapolated_s = elapsed_s - age_s;
            const Scalar bend_s2 = (age_s * age_s + extrapolated_s * (extrapolated_s + h.gap_s)) / 2 + window_s * window_s / 24;
            sum += bend_s2 * bend_s2 * h.curvature_squared + age_s * age_s * h.slope_squared;
        }
        return sum / kSourceCoils;
    }

    /// Mean variance of the nine quadratures due to motion, coupling units squared. lag_s: CommonParams::quadrature_lag_s. The
    /// slope of a column is that of half a gap before.
    [[nodiscard]] Scalar quadrature_variance(Scalar lag_s) const {
        Scalar sum = 0;
        for (const History& h : histories_) {
            sum += h.slope_squared + h.gap_s * h.gap_s / 4 * h.curvature_squared;
        }
        return lag_s * lag_s * sum / kSourceCoils;
    }

    /// Error of a matrix of extrapolated columns.
    struct Extrapolation {
        Mat3<Scalar> missing;  // true minus extrapolated couplings
        Scalar variance = 0;   // mean noise of its nine entries
    };

    /// From the last curvature of each coil's columns, without the noise limit of error_variance(). Zero for columns that are not
    /// extrapolated.
    [[nodiscard]] Extrapolation extrapolation(const SignalMatrix<Scalar>& matrix,
                                              const std::array<Curvature, kSourceCoils>& curvatures) const {
        Extrapolation result;
        for (std::size_t j = 0; j < kSourceCoils; ++j) {
            const History& h = histories_[j];
            const auto column = static_cast<Index>(j);
            const Scalar extrapolated_s = seconds_as<Scalar>(matrix.newest - h.time) - matrix.column_age_s(column);
            const Scalar bend_s2 = extrapolated_s * (extrapolated_s + h.gap_s) / 2;
            result.missing.col(column) = bend_s2 * curvatures[j].value;
            result.variance += bend_s2 * bend_s2 * curvatures[j].variance / kSourceCoils;
        }
        return result;
    }

    void clear() { histories_ = {}; }

private:
    static constexpr double kMinLongestGap_s = 0.015;
    static constexpr double kMinGap_s = 1e-4;  // keeps the derivatives of all couplings within float
    // Decay time of the squared second derivative. The derivative is late by one and a half frames. At 5 Hz it changes by 0.19 of
    // its amplitude in this time, and 0.38 of the amplitude is left where it changes sign.
    static constexpr double kMemory_s = 0.02;

    struct History {
        Vec3<Scalar> couplings = Vec3<Scalar>::Zero();
        Vec3<Scalar> slope = Vec3<Scalar>::Zero();  // 1/s
        Scalar slope_squared = 0;                   // mean square of an entry of X', 1/s^2
        Scalar curvature_squared = 0;               // the same of X'' without its noise, 1/s^4, decaying
        Scalar gap_s = 0;                           // between the last two columns
        int columns = 0;                            // with short gaps; counts to 3
        DeviceTime time{};
    };

    /// Longest gap between two columns of a coil across which they give a derivative: three frames, at least 15 ms. The frame
    /// follows from the span of three TDM columns (0.8 of a frame); an FDM frame is a little longer than its window.
    static Scalar longest_gap_s(const CommonParams<Scalar>& params) {
        const Scalar tdm_frame_s = seconds_as<Scalar>(params.max_column_span) / Scalar(0.8);
        return std::max({Scalar(kMinLongestGap_s), 3 * tdm_frame_s, 4 * params.window_s});
    }

    /// Mean square of the entries of a derivative without the part that noise of the given variance explains.
    static Scalar significant(const Vec3<Scalar>& derivative, Scalar noise) {
        constexpr Scalar kChance = 4;  // mean of three squares: exceeded once in 135
        return std::max(Scalar(0), derivative.squaredNorm() / 3 - kChance * noise);
    }

    /// Second derivative from the slope before (still in `h`) and the present one. variance: noise of a coupling.
    static Curvature second_derivative(const History& h, const Vec3<Scalar>& slope, Scalar gap_s, Scalar variance) {
        const Scalar per_mean_gap = 2 / (gap_s + h.gap_s);
        const Scalar a = 1 / gap_s;
        const Scalar b = 1 / h.gap_s;
        return {per_mean_gap * (slope - h.slope), per_mean_gap * per_mean_gap * variance * (a * a + b * b + (a + b) * (a + b))};
    }

    Scalar max_gap_s_;
    std::array<History, kSourceCoils> histories_{};
};

}  // namespace tricoil::tracking
