#include "core/tracking/dual_band/metal_signature.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace tricoil::tracking {
namespace {

using Complex = std::complex<double>;

constexpr double kLeastTime_s = 3e-7;  // relaxation times of the table: foil and thin wires of titanium
constexpr double kMostTime_s = 3e-2;   // thick copper
constexpr double kLargestGain = 30;    // beyond it both bands see the same
constexpr double kGainPrior = 1.5;     // power of 1 / (1 + |gain|) in the prior: thick metal is rare
/// Real shapes differ from the table, and from entry to entry: standard deviation of each part relative to the whole.
constexpr double kModelError = 0.25;
constexpr double kRedundantError = 0.15;  // the same for the redundant numbers, which are a part of the whole
constexpr double kRefinedError = 0.07;
constexpr double kLeastGainError = 0.4;   // of the table, relative to the effect in the low band
constexpr double kRedundantFloor = 3e-6;  // of a redundant number: noise and motion, coupling units
constexpr double kOtherCoils = 0.2;       // weight of the other coils' evidence

/// Shapes of gamma distributions of relaxation rates; 0: a single rate. 1.65: simulated sheets of 0.3 m beside the line from
/// source to sensor; small sheets and rods are between it and a single rate.
constexpr std::array<double, 3> kRateShapes{0, 1.65, 4};
constexpr std::array<double, 3> kShapePriors{-2, 0, -1};  // logarithms
constexpr double kSpherePrior = -1;
constexpr double kFerromagneticPrior = -2.5;  // of each permeability
constexpr int kRates = 64;                    // of a distribution, for its integrals

double angular(double hz) { return 2 * std::numbers::pi * hz; }

/// Squared effects of both bands, relative to the squared difference. The effect in the high band alone may be zero.
Vec3<double> both_effects(const Vec3<double>& gain) { return gain.cwiseAbs2() + (gain - Vec3<double>::Ones()).cwiseAbs2(); }

/// Relative response of loops, -1 for perfect conductors. Rates 1/T have the mean 1/time_s.
Complex loop_response(double hz, double time_s, double shape) {
    const Complex iw(0, angular(hz) * time_s);
    if (shape == 0) {
        return -iw / (1.0 + iw);
    }
    Complex sum = 0;
    double weights = 0;
    for (int n = 0; n < kRates; ++n) {  // over the logarithm of the rate
        const double rate = std::exp(-6 + 8 * (n + 0.5) / kRates);
        const double weight = std::pow(rate, shape) * std::exp(-shape * rate);
        weights += weight;
        sum -= weight * iw / (rate + iw);
    }
    return sum / weights;
}

/// Relative response of a sphere (Wait 1951), -1 for a perfect conductor. time_s: mu0 conductivity radius^2.
Complex sphere_response(double hz, double time_s, double permeability) {
    const Complex z = std::sqrt(Complex(0, angular(hz) * time_s * permeability));
    const Complex e = std::exp(-2.0 * z);
    const Complex t = std::abs(z) < 1e-2 ? 1.0 + z * z / 3.0 : z * (1.0 + e) / (1.0 - e);  // z coth z
    const Complex eddy = z * z + 1.0 - t;
    return (2 * permeability * (t - 1.0) - eddy) / (permeability * (t - 1.0) + eddy);
}

}  // namespace

MetalSignature::MetalSignature(const Tones& high_hz, const Tones& low_hz) {
    const double step = std::log(kMostTime_s / kLeastTime_s) / (kSizes - 1);
    for (int n = 0; n < kSizes; ++n) {
        const double time_s = kLeastTime_s * std::exp(step * n);
        for (std::size_t i = 0; i < kRateShapes.size(); ++i) {
            add_metal(high_hz, low_hz, kShapePriors[i], [&](double hz) { return loop_response(hz, time_s, kRateShapes[i]); });
        }
        for (const double permeability : kPermeabilities) {
            ferromagnetic_ = permeability > 1 ? 1 : 0;
            add_metal(high_hz, low_hz, permeability > 1 ? kFerromagneticPrior : kSpherePrior,
                      [&](double hz) { return sphere_response(hz, time_s, permeability); });
        }
        ferromagnetic_ = 0;
    }
    update();
}

template <typename Response>
void MetalSignature::add_metal(const Tones& high_hz, const Tones& low_hz, double prior, const Response& response) {
    Metal metal{};
    double largest = 0;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        const Complex high = response(high_hz[j]);
        const Complex low = response(low_hz[j]);
        const double difference = high.real() - low.real();
        metal.coil[j] = {low.imag() / difference, high.imag() / difference, high.real() / difference};
        largest = std::max(largest, std::abs(metal.coil[j].gain));
    }
    if (!(largest < kLargestGain)) {
        return;
    }
    metal.ferromagnetic = ferromagnetic_ > 0;
    metal.prior = prior - kGainPrior * std::log1p(largest);
    metals_[count_++] = metal;
}

void MetalSignature::add(const BandEvidence& evidence, double kept) {
    weight_ = kept * weight_ + 1;
    low_variance_ += (evidence.low_variance - low_variance_) / weight_;
    high_variance_ += (evidence.high_variance - high_variance_) / weight_;
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        Mat3<double> parts;  // row: sensor coil
        parts << evidence.difference.col(j), evidence.low_quadrature.col(j), evidence.high_quadrature.col(j);
        Mat3<double>& sum = moments_[static_cast<std::size_t>(j)];
        sum = kept * sum + parts.transpose() * parts;
    }
    // Lines with an uncertain difference count less.
    const double relative = kRefinedError * kRefinedError * evidence.difference.squaredNorm() / 9;
    const double line = 1 / (evidence.state_variance + relative + kRedundantFloor * kRedundantFloor);
    const double noise = line * evidence.state_variance;
    redundant_weight_ = kept * redundant_weight_ + line;
    redundant_square_ = kept * redundant_square_ + line * evidence.redundant.squaredNorm();
    redundant_product_ = kept * redundant_product_ + line * evidence.redundant_difference.transpose() * evidence.redundant;
    redundant_moment_ =
        kept * redundant_moment_ + line * evidence.redundant_difference.transpose() * evidence.redundant_difference;
    redundant_noise_ = kept * redundant_noise_ + noise;
    difference_square_ = kept * difference_square_ + line * evidence.difference.colwise().squaredNorm().transpose();
    update();
}

/// Logarithm of the likelihood of the redundant numbers. Their error is the same for a long time, so they count once.
double MetalSignature::redundant_fit(const Metal& metal) const {
    if (weight_ == 0) {
        return 0;
    }
    const Vec3<double> gain(metal.coil[0].gain, metal.coil[1].gain, metal.coil[2].gain);
    const double misfit =
        (redundant_square_ - 2 * gain.dot(redundant_product_) + gain.dot(redundant_moment_ * gain)) / redundant_weight_;
    const double effect = both_effects(gain).dot(difference_square_) / redundant_weight_;
    const double variance = kRedundantFloor * kRedundantFloor + kRedundantError * kRedundantError * effect / 9 +
                            gain.squaredNorm() / 3 * redundant_noise_ / redundant_weight_;
    return -0.5 * (std::max(misfit, 0.0) / variance + 3 * std::log(variance));
}

/// Part of the squared evidence of each coil that each metal explains.
void MetalSignature::update() {
    std::array<std::array<double, kMetals>, kSourceCoils> fits{};
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        // Consecutive windows contain the same error of the model, so it does not average.
        const double model = kModelError * kModelError * moments_[j].trace() / 3;
        const Vec3<double> information(1 / (low_variance_ + model), 1 / (low_variance_ + model), 1 / (high_variance_ + model));
        const Vec3<double> noise_free(1 / low_variance_, 1 / low_variance_, 1 / high_variance_);
        // Noise has random ratios: only the part above it is evidence.
        const double seen = noise_free.dot(moments_[j].diagonal());
        const double chance = 9 * weight_ + 3 * std::sqrt(18 * weight_);
        const double share = std::max(0.0, 1 - chance / std::max(seen, 1e-300));
        for (std::size_t n = 0; n < count_; ++n) {
            const Ratios& ratios = metals_[n].coil[j];
            const Vec3<double> pattern(1, ratios.low_quadrature, ratios.high_quadrature);
            const Vec3<double> weighted = information.cwiseProduct(pattern);
            fits[j][n] = share * weighted.dot(moments_[j] * weighted) / pattern.dot(weighted) / 2;
        }
    }
    ferromagnetic_ = 0;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        update_coil(j, fits);
    }
    refine_gain();
}

/// Least squares of redundant = redundant_difference * gain, with the posterior of the table as prior.
void MetalSignature::refine_gain() {
    gain_covariance_ = (gain_sigma_.cwiseAbs2() + (kLeastGainError * (gain_ - Vec3<double>::Ones())).cwiseAbs2()).asDiagonal();
    if (weight_ == 0) {
        return;
    }
    const double effect = (both_effects(gain_) + gain_sigma_.cwiseAbs2()).dot(difference_square_) / redundant_weight_;
    const double variance = kRedundantFloor * kRedundantFloor + kRefinedError * kRefinedError * effect / 9 +
                            (gain_.squaredNorm() + gain_sigma_.squaredNorm()) / 3 * redundant_noise_ / redundant_weight_;
    // Noise of the difference would bias the gain towards zero.
    const Mat3<double> moment =
        redundant_moment_ - std::min(redundant_noise_, redundant_moment_.trace() / 6) * Mat3<double>::Identity();
    const Mat3<double> information = redundant_moment_ / (redundant_weight_ * variance);
    const Vec3<double> residual = (redundant_product_ - moment * gain_) / (redundant_weight_ * variance);
    const Mat3<double> joint = Mat3<double>::Identity() + gain_covariance_ * information;
    const Mat3<double> inverse = joint.inverse();
    gain_covariance_ = (inverse * gain_covariance_).eval();
    gain_ += gain_covariance_ * residual;
}

void MetalSignature::update_coil(std::size_t coil, const std::array<std::array<double, kMetals>, kSourceCoils>& fits) {
    std::array<double, kMetals> log_weight{};
    for (std::size_t n = 0; n < count_; ++n) {
        log_weight[n] = metals_[n].prior + redundant_fit(metals_[n]) + (1 - kOtherCoils) * fits[coil][n];
        for (const auto& fit : fits) {
            log_weight[n] += kOtherCoils * fit[n];
        }
    }
    const double best = *std::max_element(log_weight.begin(), log_weight.begin() + static_cast<std::ptrdiff_t>(count_));
    double total = 0;
    double ferromagnetic = 0;
    Vec3<double> sum = Vec3<double>::Zero();  // of gain, quadrature of the low and of the high band
    Vec3<double> square = Vec3<double>::Zero();
    for (std::size_t n = 0; n < count_; ++n) {
        const double weight = std::exp(log_weight[n] - best);
        const Ratios& ratios = metals_[n].coil[coil];
        const Vec3<double> values(ratios.gain, ratios.low_quadrature, ratios.high_quadrature);
        total += weight;
        ferromagnetic += metals_[n].ferromagnetic ? weight : 0;
        sum += weight * values;
        square += weight * values.cwiseAbs2();
    }
    const Vec3<double> mean = sum / total;
    const Vec3<double> sigma = (square / total - mean.cwiseAbs2()).cwiseMax(0).cwiseSqrt();
    const auto j = static_cast<Eigen::Index>(coil);
    gain_(j) = mean(0);
    gain_sigma_(j) = sigma(0);
    low_quadrature_(j) = mean(1);
    low_quadrature_sigma_(j) = sigma(1);
    high_quadrature_(j) = mean(2);
    high_quadrature_sigma_(j) = sigma(2);
    ferromagnetic_ += ferromagnetic / total / kSourceCoils;
}

}  // namespace tricoil::tracking
