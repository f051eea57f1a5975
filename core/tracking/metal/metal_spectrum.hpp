// Effect of non-magnetic metal on the high band, from what both bands show of its eddy currents.
#pragma once

#include <optional>

#include "core/linear/matrix.hpp"

namespace tricoil::tracking {

/// What metal adds to a coupling, in this order: quadrature of the low band, quadrature of the high band, and the in-phase effect
/// on the high band minus that on the low band.
using MetalSignals = Vec3<double>;

/// Each eddy current of a non-magnetic conductor has a relaxation frequency f_m. At the frequency f it adds, with x = f / f_m,
/// A x^2 / (1 + x^2) in phase and A x / (1 + x^2) in quadrature, and all A have one sign. So the quadratures, and the difference
/// of the bands, also show the part of the metal's effect that both bands have in common.
///
/// The amplitudes A come from three redundant couplings, and hold for all nine only approximately: eddy currents whose relaxation
/// frequencies are far apart flow along different paths. In each coupling the amplitudes are therefore taken as random, of the
/// common size, and correlated the more the closer their frequencies are.
class MetalSpectrum {
public:
    /// ratios: of the signals to the in-phase effect in the high band. variance: of the ratios. nullopt if no spectrum explains
    /// them (ferromagnetic metal), or noise hides them.
    static std::optional<MetalSpectrum> fit(const MetalSignals& ratios, const MetalSignals& variance);

    struct Extrapolation {
        Vec3<double> weights;  // of the signals, to be summed
        double variance = 0;   // of the sum, by different paths, without the noise of the signals
    };
    /// Best linear estimate of the effect on a coupling of the high band. effect_variance: mean square of that effect. noise:
    /// variance of each signal of one coupling.
    [[nodiscard]] Extrapolation extrapolate(double effect_variance, const MetalSignals& noise) const;

    /// Number of relaxation frequencies.
    static constexpr int kCurrents = 9;

private:
    Matrix<double, kCurrents, 1> amplitude_;
    MetalSignals ratios_;
};

}  // namespace tricoil::tracking
