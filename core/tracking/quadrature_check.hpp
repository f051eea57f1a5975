// Quadrature of the couplings beyond noise, motion and the phases of the channels. Metal causes it, and no pose explains it.
#pragma once

#include "core/tracking/column_motion.hpp"
#include "core/tracking/misfit.hpp"
#include "core/tracking/signal_matrix_assembler.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Eddy currents in metal lag behind the field that induces them, so that the metal's couplings have a quadrature, small for
/// thick copper, large for thin sheets and steel. It is treated as another misfit of the same metal: the in-phase couplings of
/// the metal are taken as kHiddenShare times as large.
template <typename Scalar>
class QuadratureCheck {
public:
    /// Judges the columns of a matrix. strength: k, coupling units. True if they show metal.
    bool add(const SignalMatrix<Scalar>& matrix, Scalar strength, const ColumnMotion<Scalar>& motion,
             const CommonParams<Scalar>& params) {
        if (params.quadrature_floor >= 1) {
            return false;
        }
        const Scalar floor = params.quadrature_floor * strength;
        const Scalar still = matrix.sigma * matrix.sigma + floor * floor;
        const Scalar expected = still + motion.quadrature_variance(params.quadrature_lag_s);
        const Scalar squared = matrix.quadrature_squared / 3;  // as the misfit: per three degrees of freedom
        const Scalar gate = Scalar(kNineDegrees) * params.distortion_gate;
        misfit_.add(squared, expected, still, gate, matrix.newest);
        return squared > gate * expected;
    }

    /// As Misfit::variance().
    [[nodiscard]] Scalar variance() const { return misfit_.variance(); }

private:
    // Chi-square of nine degrees of freedom over that of three that is exceeded once in 10,000, each per degree of freedom.
    static constexpr double kNineDegrees = 33.7 / 9 / (21.1 / 3);

    Misfit<Scalar> misfit_;
};

}  // namespace tricoil::tracking
