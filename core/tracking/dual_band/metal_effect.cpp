#include "core/tracking/dual_band/metal_effect.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::tracking {
namespace {

constexpr double kNoMetal = 0.05;            // prior probability
constexpr double kStrengthStep = 4;          // between variances
constexpr double kTopStrength = 1.5;         // largest variance, relative to the mean square of the evidence
constexpr double kEvidenceWeight = 0.2;      // the nine entries of one object are not independent
constexpr double kRedundantWeight = 0.5;     // the same
constexpr double kSpread = 3;                // of variances within a kind: real objects differ from the table
constexpr double kLeastShare = 1e-4;         // components below it do not count
constexpr double kLeastDeterminant = 1e-90;  // of three in a product

struct Inverse {
    Mat3<double> matrix;
    double determinant;
};
/// Of a symmetric positive definite matrix.
Inverse invert(const Mat3<double>& a) {
    Mat3<double> cofactor;
    cofactor.col(0) = a.col(1).cross(a.col(2));
    cofactor.col(1) = a.col(2).cross(a.col(0));
    cofactor.col(2) = a.col(0).cross(a.col(1));
    const double determinant = std::max(a.col(0).dot(cofactor.col(0)), kLeastDeterminant);
    return {cofactor / determinant, determinant};
}

}  // namespace

/// A change by motion has the same spread as the effect itself: where the object has moved, all parts change together, and the
/// quadrature of the high band shows the change at once.
MetalEstimator::Component MetalEstimator::fit(const MetalKind& kind, double scale, const MetalEvidence& evidence) {
    Component out{};
    double square = 0;
    double determinant = 1;
    for (Eigen::Index j = 0; j < 3; ++j) {
        const auto& m = kind.moments[static_cast<std::size_t>(j)];
        const Vec4<double> cross = scale * Vec4<double>(m[1], m[2], m[3], m[3]);
        Eigen::Matrix4d moments;
        moments << m[4], m[5], m[6], m[6], m[5], m[7], m[8], m[8], m[6], m[8], m[9], m[9], m[6], m[8], m[9], m[9];
        moments.topLeftCorner<3, 3>() *= 1 + evidence.change;
        moments *= scale;
        moments.diagonal() += evidence.variance;
        const Eigen::Matrix4d inverse = moments.inverse();
        Eigen::Matrix<double, 3, 4> seen;  // one column per part
        seen << evidence.predicted[0].col(j), evidence.predicted[1].col(j), evidence.predicted[2].col(j),
            evidence.high_quadrature.col(j);
        square += (seen * inverse).cwiseProduct(seen).sum();
        determinant *= std::max(moments.determinant(), kLeastDeterminant);
        const Vec4<double> weights = inverse * cross;
        out.mean.col(j) = seen * weights;
        out.variance(j) = kSpread * std::max(scale * m[0] - weights.dot(cross), 0.0);
    }
    out.log_weight = -kEvidenceWeight * 0.5 * (square + 3 * std::log(determinant));
    return out;
}

void MetalEstimator::add_redundant(const MetalEvidence& evidence, Component& component) {
    const auto& redundant = evidence.redundant_of_effect;
    Eigen::Matrix<double, 9, 3> spread;  // covariance of the effect times the transposed matrix
    for (Eigen::Index j = 0; j < 3; ++j) {
        spread.middleRows<3>(3 * j) = component.variance(j) * redundant.middleCols<3>(3 * j).transpose();
    }
    Mat3<double> covariance = redundant * spread;
    covariance.diagonal().array() += evidence.redundant_variance;
    const Inverse inverse = invert(covariance);
    const Vec3<double> innovation = evidence.redundant - redundant * component.mean.reshaped();
    component.log_weight -=
        kRedundantWeight * 0.5 * (innovation.dot(inverse.matrix * innovation) + std::log(inverse.determinant));
    component.gain = spread * inverse.matrix;
    component.mean.reshaped() += component.gain * innovation;
}

MetalEffect MetalEstimator::estimate(const MetalEvidence& evidence) {
    const double square =
        evidence.predicted[0].squaredNorm() + evidence.predicted[1].squaredNorm() + evidence.high_quadrature.squaredNorm();
    double scale = kTopStrength * square / 9;
    std::size_t n = 0;
    for (int strength = 0; strength < kStrengths; ++strength, scale /= kStrengthStep) {
        for (const MetalKind& kind : kMetalKinds) {
            components_[n] = fit(kind, scale, evidence);
            components_[n].log_weight += std::log(kind.weight * (1 - kNoMetal) / kStrengths);
            ++n;
        }
    }
    components_[n] = fit({1, {}}, 0, evidence);
    components_[n].log_weight += std::log(kNoMetal);
    double best = -1e300;
    for (Component& component : components_) {
        add_redundant(evidence, component);
        best = std::max(best, component.log_weight);
    }
    MetalEffect effect;
    double total = 0;
    for (const Component& component : components_) {
        const double share = std::exp(component.log_weight - best);
        if (share < kLeastShare) {
            continue;
        }
        total += share;
        effect.mean += share * component.mean;
        effect.covariance += share * component.mean.reshaped() * component.mean.reshaped().transpose();
        for (Eigen::Index j = 0; j < 3; ++j) {
            effect.covariance.block<3, 3>(3 * j, 3 * j).diagonal().array() += share * component.variance(j);
            effect.covariance.middleCols<3>(3 * j) -=
                share * component.variance(j) * component.gain * evidence.redundant_of_effect.middleCols<3>(3 * j);
        }
    }
    effect.mean /= total;
    effect.covariance = effect.covariance / total - effect.mean.reshaped() * effect.mean.reshaped().transpose();
    return effect;
}

}  // namespace tricoil::tracking
