// Effect of metal on the couplings of the high band, from what both bands show of it.
#pragma once

#include <array>

#include <Eigen/Geometry>

#include "core/geometry/types.hpp"
#include "core/tracking/dual_band/metal_table.hpp"

namespace tricoil::tracking {

template <typename Scalar>
using Vec4 = Eigen::Matrix<Scalar, 4, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// Rows of matrices: axes of the source; columns: source coils. All parts are changes of couplings by metal.
struct MetalEvidence {
    /// What the last windows of the low band predict for now: difference (in phase, high band minus low band), quadrature of the
    /// low band, quadrature of the high band. Quadrature without the part that motion induces.
    std::array<Mat3<double>, 3> predicted;
    Mat3<double> high_quadrature;  // measured now
    Vec4<double> variance;         // of one entry of these four: noise
    double change;                 // variance of the error of the predictions by motion, relative to that of the evidence
    Vec3<double> redundant;        // numbers of the high band that no pose explains: without metal and noise they are zero
    double redundant_variance;     // of each
    Eigen::Matrix<double, 3, 9> redundant_of_effect;  // the same numbers of an effect (in column order)
};

/// In phase, in the high band.
struct MetalEffect {
    Mat3<double> mean = Mat3<double>::Zero();
    Mat9 covariance = Mat9::Zero();  // in column order
};

/// A mixture of normal distributions: each kind of metal of the table, at several strengths, and no metal. Within a kind, the
/// effect is a linear function of the evidence, and its spread is that of the kind.
class MetalEstimator {
public:
    MetalEffect estimate(const MetalEvidence& evidence);

private:
    static constexpr int kStrengths = 7;
    static constexpr std::size_t kComponents = kMetalKinds.size() * kStrengths + 1;  // the last one: no metal

    struct Component {
        double log_weight;
        Mat3<double> mean;
        Vec3<double> variance;             // of an entry, per source coil
        Eigen::Matrix<double, 9, 3> gain;  // of the redundant numbers
    };
    [[nodiscard]] static Component fit(const MetalKind& kind, double scale, const MetalEvidence& evidence);
    static void add_redundant(const MetalEvidence& evidence, Component& component);

    std::array<Component, kComponents> components_{};
};

}  // namespace tricoil::tracking
