// Quadrature of the couplings that noise, motion and the calibrated phases do not explain: a sign of metal.
#pragma once

#include "core/tracking/front/column_motion.hpp"
#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Eddy currents lag behind the field that induces them, so the couplings of metal have a quadrature: small for thick copper and
/// aluminium, large for thin sheets, type 304 and steel. It is judged like the misfit, also with kHiddenShare as ratio of the
/// unknown in-phase couplings to it. For random objects (tests/support/metal_case.hpp) that ratio is 2.2 in the median and 10 in
/// one of ten, most of them of copper and aluminium, which the misfit shows better.
template <typename Scalar>
class QuadratureCheck {
public:
    /// Judges the columns of a matrix. strength: k, coupling units. share: as in Misfit. True if they show metal.
    bool add(const SignalMatrix<Scalar>& matrix, Scalar strength, const ColumnMotion<Scalar>& motion,
             const CommonParams<Scalar>& params, Scalar share = 1) {
        if (params.quadrature_floor >= 1) {
            return false;
        }
        const Scalar floor = params.quadrature_floor * strength;
        const Scalar still = matrix.quadrature_variance + floor * floor + params.pick_up_sigma * params.pick_up_sigma;
        const Scalar expected = still + motion.quadrature_variance(params.quadrature_lag_s);
        const Scalar squared = matrix.quadrature_squared / 3;  // as the misfit: of three degrees of freedom
        misfit_.add(squared, expected, still, gate(params), matrix.newest, share);
        return squared > gate(params) * expected;
    }

    /// Limit of a third of the sum of the nine squared quadratures, relative to the variance of one.
    static Scalar gate(const CommonParams<Scalar>& params) { return Scalar(kNineDegrees) * params.distortion_gate; }

    /// As Misfit::variance().
    [[nodiscard]] Scalar variance() const { return misfit_.variance(); }

    /// For columns that cannot be judged: faults, or unknown motion.
    void clear() { misfit_ = {}; }

private:
    // Chi-square of nine degrees of freedom over that of three that is exceeded once in 10,000, each per degree of freedom.
    static constexpr double kNineDegrees = 33.7 / 9 / (21.1 / 3);

    Misfit<Scalar> misfit_;
};

}  // namespace tricoil::tracking
