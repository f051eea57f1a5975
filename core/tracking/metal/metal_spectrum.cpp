#include "core/tracking/metal/metal_spectrum.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/linear/cholesky.hpp"

namespace tricoil::tracking {
namespace {

constexpr int kCurrents = MetalSpectrum::kCurrents;
// Geometric means of the carriers at 240 frames/s. One spectrum serves all carriers of a band, which differ by up to a factor
// of 2.
constexpr double kLow_hz = 690;
constexpr double kHigh_hz = 10.1e3;
/// Relaxation frequencies, equidistant in the logarithm: 30 Hz is that of a plate of copper of 10 cm, 2 mm thick.
constexpr std::array<double, kCurrents> kRelaxation_hz{30, 95, 300, 950, 3000, 9500, 30000, 95000, 300000};
constexpr double kNeighbours = 0.92;  // correlation of the amplitudes of two neighbours

using Currents = Matrix<double, kCurrents, 1>;
/// Rows: the three signals, and the effect on the high band. Columns: relaxation frequencies, for amplitudes of 1.
using Response = Matrix<double, 4, kCurrents>;

Response response() {
    const auto in_phase = [](double x) { return x * x / (1 + x * x); };
    const auto quadrature = [](double x) { return x / (1 + x * x); };
    Response r;
    for (int m = 0; m < kCurrents; ++m) {
        const double relaxation_hz = kRelaxation_hz[static_cast<std::size_t>(m)];
        const double low = kLow_hz / relaxation_hz;
        const double high = kHigh_hz / relaxation_hz;
        r.col(m) << quadrature(low), quadrature(high), in_phase(high) - in_phase(low), in_phase(high);
    }
    return r;
}

/// Least squares with amplitudes of at least zero, one after the other. a: four weighted equations.
Currents non_negative_least_squares(const Response& a, const Matrix<double, 4, 1>& b) {
    constexpr int kSweeps = 300;
    const Matrix<double, kCurrents, kCurrents> normal = a.transpose() * a;
    const Currents right = a.transpose() * b;
    Currents x = Currents::Zero();
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        for (int m = 0; m < kCurrents; ++m) {
            x(m) = std::max(0.0, x(m) + (right(m) - normal.col(m).dot(x)) / normal(m, m));
        }
    }
    return x;
}

}  // namespace

std::optional<MetalSpectrum> MetalSpectrum::fit(const MetalSignals& ratios, const MetalSignals& variance) {
    const MetalSignals model_error = MetalSignals(0.02, 0.01, 0.02).cwiseProduct(MetalSignals::Ones() + ratios.cwiseAbs());
    constexpr double kEffectError = 0.02;
    constexpr double kMostVariance = 3e-3;
    constexpr double kWorstFit = 64;  // chi-square; a sphere of type 416 steel has 90 and more from a diameter of 10 mm on
    if (!(variance.maxCoeff() < kMostVariance)) {
        return std::nullopt;
    }
    Matrix<double, 4, 1> weight;
    weight << (model_error.cwiseAbs2() + variance).cwiseSqrt().cwiseInverse(), 1 / kEffectError;
    Matrix<double, 4, 1> measured;
    measured << ratios, 1;
    const Response weighted = weight.asDiagonal() * response();
    const Matrix<double, 4, 1> target = weight.cwiseProduct(measured);
    MetalSpectrum spectrum;
    spectrum.ratios_ = ratios;
    spectrum.amplitude_ = non_negative_least_squares(weighted, target);
    if (!((weighted * spectrum.amplitude_ - target).squaredNorm() < kWorstFit)) {
        return std::nullopt;
    }
    return spectrum;
}

MetalSpectrum::Extrapolation MetalSpectrum::extrapolate(double effect_variance, const MetalSignals& noise) const {
    const Response effects = response() * amplitude_.asDiagonal();
    using Correlation = Matrix<double, kCurrents, kCurrents>;
    const Correlation correlation =
        Correlation::NullaryExpr([](Index m, Index n) { return std::pow(kNeighbours, std::abs(m - n)); });
    const Matrix<double, 4, 4> covariance = effect_variance * effects * correlation * effects.transpose();
    Mat3<double> signals = covariance.topLeftCorner<3, 3>();
    // Signals differ from those of the spectrum by the currents' paths: of the high band's part, the difference of the bands
    // shows all but what the low band has in common with it.
    constexpr double kError = 0.05;
    const MetalSignals error = kError * MetalSignals(ratios_(0), ratios_(1), 1 - ratios_(2));
    signals.diagonal() += noise + effect_variance * error.cwiseAbs2();
    const Cholesky<double, 3> factor(signals);
    if (!factor.ok()) {
        return {Vec3<double>::Zero(), covariance(3, 3)};
    }
    const Vec3<double> common = covariance.topRightCorner<3, 1>();
    const Vec3<double> weights = factor.solve<1>(common);
    const double left = covariance(3, 3) - 2 * weights.dot(common) + weights.dot(covariance.topLeftCorner<3, 3>() * weights);
    return {weights, std::max(left, 0.0)};
}

}  // namespace tricoil::tracking
