#include "core/tracking/dual_band/band_correction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/geometry/rotations.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/misfit.hpp"

namespace tricoil::tracking {
namespace {

// Relative to the strength k of the coupling.
constexpr double kFirstSigma = 0.3;   // of the difference, before the first low-band matrix
constexpr double kFirstRate = 1;      // of its rate, 1/s
constexpr double kLeastNoise = 1e-8;  // process noise, 1/s^3: 1e-4 of k after 3 s
constexpr double kMostNoise = 1e3;
constexpr double kNoiseGain = 0.6;  // weight of one matrix in the logarithm of the process noise
constexpr double kLargestNoiseStep = 4;
constexpr double kGate = 3.1;                  // mean squared innovation of 9 entries over its variance: exceeded once in 1,000
constexpr double kOverlap = 1.3;               // consecutive windows share noise
constexpr double kRatioError = 0.2;            // relative error of the ratios of quadrature to the difference
constexpr double kMemory_s = 0.7;              // of the evidence about the kind of metal
constexpr double kSpread = 0.15;               // relative error of the low band's effect: shapes differ from the table
constexpr double kFerromagneticSpread = 0.35;  // in addition, for iron and steel
constexpr double kLag_s = 0.02;       // between low-band matrices the difference may deviate from a constant rate by this time
constexpr double kConcentration = 3;  // errors with a pattern act on few entries, and more on the pose than white noise
constexpr double kConsistencyGain = 0.2;   // weight of one matrix in the mean squared innovation
constexpr double kQuadratureFloor = 1e-4;  // relative to k: phases of the channels
constexpr double kLeakage_s = 1e-4;        // quadrature from motion, between the carriers

constexpr double kLeastDistortion_m = 1e-3;

}  // namespace

BandCorrection::BandCorrection(const BandCorrectionParams& params)
    : params_(params),
      signature_(params.high_hz, {params.low_band.tone_hz(0), params.low_band.tone_hz(1), params.low_band.tone_hz(2)}) {
    // Area of the Hann window over each block, oldest and newest alike.
    const int count = params.low_band.window_blocks;
    const auto area = [&](int n) {
        if (n < 0 || n >= count) {
            return 0.0;
        }
        const double turn = 2 * std::numbers::pi / count;
        return 1.0 / count - (std::sin(turn * (n + 1)) - std::sin(turn * n)) / (2 * std::numbers::pi);
    };
    for (int n = 0; n < count; ++n) {
        const auto i = static_cast<std::size_t>(n);
        weights_[i] = area(n);
        // Columns are means over their blocks. The second difference makes the mean exact for parabolas.
        mean_weights_[i] = area(n) - (area(n - 1) - 2 * area(n) + area(n + 1)) / 12;
        rate_weights_[i] = (area(n + 1) - area(n - 1)) / (2 * params.low_band.block_s());
    }
    const double sum = std::accumulate(mean_weights_.begin(), mean_weights_.end(), 0.0);
    for (double& weight : mean_weights_) {
        weight /= sum;
    }
}

const BandCorrection::Block& BandCorrection::block_before(int count) const {
    const auto size = static_cast<std::size_t>(params_.low_band.window_blocks);
    return blocks_[(next_ + size - 1 - static_cast<std::size_t>(count)) % size];
}

void BandCorrection::correct(signal::Columns<double>& columns, const std::optional<signal::LowBandMatrix>& low) {
    predict();
    bool usable = columns.size() == kSourceCoils;
    Block block;
    double high_variance = 0;
    for (std::size_t j = 0; usable && j < kSourceCoils; ++j) {
        const Column<double>& column = columns[j];
        const auto index = static_cast<Eigen::Index>(coil_index(column.state));
        usable = usable && index >= 0 && !column.flags.has_any(kUnusableFlags) && column.in_phase.allFinite();
        if (usable) {
            block.in_phase.col(index) = column.in_phase;
            block.quadrature.col(index) = column.quadrature;
            high_variance += column.sigma.squaredNorm() / 9;
        }
    }
    if (!usable || !find_attitude(block)) {
        filled_ = 0;
        return;
    }
    blocks_[next_] = block;
    next_ = (next_ + 1) % static_cast<std::size_t>(params_.low_band.window_blocks);
    filled_ = std::min(filled_ + 1, params_.low_band.window_blocks);
    if (low && filled_ == params_.low_band.window_blocks) {
        add_low(*low, high_variance);
    }
    const Mat3<double> corrected = block.in_phase - block.attitude * effect();
    update_uncertainty(block, corrected);
    for (Column<double>& column : columns) {
        const int coil = coil_index(column.state);
        const double noise = signature_.gain()(coil) * signature_.gain()(coil) * variance_ * std::max(1.0, consistency_);
        column.in_phase = corrected.col(coil);
        column.sigma = (column.sigma.cwiseAbs2().array() + noise).sqrt().matrix();
    }
}

/// Metal turns the attitude slightly, so it is found from couplings that are corrected with the last attitude.
bool BandCorrection::find_attitude(Block& block) {
    const Mat3<double> before = attitude_known_ ? attitude_ : Mat3<double>::Zero();
    const auto pose = solver::solve_direct<double>(Mat3<double>(block.in_phase - before * effect()), params_.coupling_constant);
    if (!pose.ok() || !pose->right_handed) {
        return false;
    }
    attitude_ = pose->attitude;
    attitude_known_ = true;
    block.attitude = attitude_;
    strength_ = pose->strength;
    if (!started_) {
        started_ = true;
        variance_ = kFirstSigma * kFirstSigma * strength_ * strength_;
        rate_variance_ = kFirstRate * kFirstRate * strength_ * strength_;
        process_noise_ = kLeastNoise * strength_ * strength_;
    }
    return true;
}

void BandCorrection::predict() {
    if (!started_) {
        return;
    }
    const double dt = params_.low_band.block_s();
    difference_ += dt * rate_;
    variance_ += 2 * dt * covariance_ + dt * dt * rate_variance_ + process_noise_ * dt * dt * dt / 3;
    covariance_ += dt * rate_variance_ + process_noise_ * dt * dt / 2;
    rate_variance_ += process_noise_ * dt;
}

void BandCorrection::add_low(const signal::LowBandMatrix& low, double high_variance) {
    const double dt = params_.low_band.block_s();
    const int count = params_.low_band.window_blocks;
    BandEvidence evidence{};
    evidence.difference = -low.in_phase;
    evidence.low_quadrature = low.quadrature;
    evidence.high_quadrature.setZero();
    Mat3<double> rate = Mat3<double>::Zero();
    Mat3<double> expected = Mat3<double>::Zero();
    for (int n = 0; n < count; ++n) {  // n: age in blocks
        const auto i = static_cast<std::size_t>(n);
        const Block& block = block_before(n);
        evidence.difference += mean_weights_[i] * block.in_phase;
        evidence.high_quadrature += mean_weights_[i] * block.quadrature;
        rate += rate_weights_[i] * block.in_phase;
        expected += weights_[i] * block.attitude * (difference_ - n * dt * rate_);
    }
    // Motion induces the voltage dX/dt I, a quarter turn from that of the current's derivative.
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        const auto coil = static_cast<std::size_t>(j);
        evidence.low_quadrature.col(j) += rate.col(j) / (2 * std::numbers::pi * params_.low_band.tone_hz(coil));
        evidence.high_quadrature.col(j) += rate.col(j) / (2 * std::numbers::pi * params_.high_hz[coil]);
    }
    const double floor = kQuadratureFloor * strength_;
    evidence.low_variance = low.sigma.squaredNorm() / 9 + floor * floor;
    evidence.high_variance = high_variance / count + floor * floor + kLeakage_s * kLeakage_s * rate.squaredNorm() / 9;
    const Mat3<double> middle = block_before(count / 2).attitude;
    double variance = 0;
    const Mat3<double> innovation = middle.transpose() * weighted_innovation(evidence, expected, variance);
    correct_state(innovation, 0.5 * (count - 1) * dt, kOverlap * variance);
    add_redundant(block_before(0), evidence);
    signature_.add(evidence, std::exp(-params_.low_band.hop_blocks() * dt / kMemory_s));
}

/// In phase and quadrature, each weighted by its noise and by the uncertainty of the metal's ratios. variance: of an entry.
Mat3<double> BandCorrection::weighted_innovation(const BandEvidence& evidence, const Mat3<double>& expected,
                                                 double& variance) const {
    Mat3<double> innovation;
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        const double low = signature_.low_quadrature()(j);
        const double high = signature_.high_quadrature()(j);
        const double size = expected.col(j).squaredNorm() / 3 + variance_;
        const auto weight = [&](double ratio, double sigma, double noise) {
            return ratio * evidence.low_variance / (noise + (sigma * sigma + kRatioError * kRatioError * ratio * ratio) * size);
        };
        const double low_weight = weight(low, signature_.low_quadrature_sigma()(j), evidence.low_variance);
        const double high_weight = weight(high, signature_.high_quadrature_sigma()(j), evidence.high_variance);
        const double total = 1 + low_weight * low + high_weight * high;
        innovation.col(j) = (evidence.difference.col(j) - expected.col(j) +
                             low_weight * (evidence.low_quadrature.col(j) - low * expected.col(j)) +
                             high_weight * (evidence.high_quadrature.col(j) - high * expected.col(j))) /
                            total;
        variance += evidence.low_variance / total / kSourceCoils;
    }
    return innovation;
}

/// With Y = O^T X in axes along and across the line of sight, a pose explains all changes but those of the trace, of Y22 - Y33,
/// and of Y23 + Y32.
void BandCorrection::add_redundant(const Block& block, BandEvidence& evidence) const {
    const auto pose =
        solver::solve_direct<double>(Mat3<double>(block.in_phase - block.attitude * effect()), params_.coupling_constant);
    if (!pose.ok()) {
        evidence.redundant.setZero();
        evidence.redundant_difference.setZero();
        return;
    }
    const Vec3<double> u = pose->direction;
    const Eigen::Matrix<double, 3, 2> e = geometry::transverse_axes(u);
    const auto redundant = [&](const Mat3<double>& y) -> Vec3<double> {
        const Eigen::Matrix<double, 2, 2> across = e.transpose() * y * e;
        return {y.trace() / std::sqrt(3.0), (across(0, 0) - across(1, 1)) / std::sqrt(2.0),
                (across(0, 1) + across(1, 0)) / std::sqrt(2.0)};
    };
    evidence.redundant = redundant(pose->attitude.transpose() * block.in_phase);
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        Mat3<double> column = Mat3<double>::Zero();
        column.col(j) = difference_.col(j);
        evidence.redundant_difference.col(j) = redundant(column);
    }
    evidence.state_variance = variance_;
}

void BandCorrection::correct_state(const Mat3<double>& innovation, double age_s, double variance) {
    const auto expected = [&] {
        return variance_ - 2 * age_s * covariance_ + age_s * age_s * rate_variance_ + process_noise_ * age_s * age_s * age_s / 3;
    };
    const double seen = innovation.squaredNorm() / 9;
    double total = expected() + variance;
    const double ratio = seen / total;
    consistency_ += kConsistencyGain * (ratio - consistency_);
    // A change that the process noise does not explain: metal has appeared, or moves otherwise than before.
    const double unit = strength_ * strength_;
    const double step = std::clamp(kNoiseGain * (ratio - 1), -kNoiseGain, kLargestNoiseStep);
    process_noise_ = std::clamp(process_noise_ * std::exp(step), kLeastNoise * unit, kMostNoise * unit);
    if (ratio > kGate) {
        const double factor = (seen - variance) / (total - variance);
        variance_ *= factor;
        covariance_ *= factor;
        rate_variance_ *= factor;
        total = expected() + variance;
    }
    const double on_difference = variance_ - age_s * covariance_;
    const double on_rate = covariance_ - age_s * rate_variance_;
    const double gain = on_difference / total;
    const double rate_gain = on_rate / total;
    difference_ += gain * innovation;
    rate_ += rate_gain * innovation;
    variance_ = std::max(variance_ - gain * on_difference, 0.0);
    covariance_ -= gain * on_rate;
    rate_variance_ = std::max(rate_variance_ - rate_gain * on_rate, 0.0);
}

void BandCorrection::update_uncertainty(const Block& block, const Mat3<double>& corrected) {
    const Vec3<double> gain = signature_.gain();
    const Vec3<double> low_share = gain - Vec3<double>::Ones();  // effect in the low band, relative to the difference
    double noise = 0;
    double pattern = 0;
    const double spread = kSpread + kFerromagneticSpread * signature_.ferromagnetic();
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        const double by_shape = spread * low_share(j);
        const double by_lag = kLag_s * gain(j);
        noise += 3 * gain(j) * gain(j) * variance_ * std::max(1.0, consistency_);
        pattern += (signature_.gain_covariance()(j, j) + by_shape * by_shape) * difference_.col(j).squaredNorm() +
                   by_lag * by_lag * rate_.col(j).squaredNorm();
    }
    effect_sigma_ = std::sqrt((noise + kConcentration * pattern) / 9);
    const auto high = solver::solve_direct<double>(block.in_phase, params_.coupling_constant);
    const auto low = solver::solve_direct<double>(corrected, params_.coupling_constant);
    if (high.ok() && low.ok()) {
        const Vec3<double> a = high->range_m * high->direction;
        const Vec3<double> b = low->range_m * low->direction;
        displacement_m_ = std::min((a - b).norm(), (a + b).norm());
        displacement_sigma_m_ =
            position_deviation(low->strength, low->range_m, std::max(gain.norm(), 1.0) * std::sqrt(variance_));
    }
}

void BandCorrection::finish(PoseEstimate<double>& estimate) const {
    const double range = estimate.position_m.norm();
    if (!started_ || !(range > 0)) {
        return;
    }
    const double strength = params_.coupling_constant / (range * range * range);
    estimate.covariance += solver::pose_covariance<double>(strength, range, estimate.position_m / range, effect_sigma_);
    estimate.distortion_m = std::max(estimate.distortion_m, displacement_m_);
    estimate.flags.set_if(displacement_m_ > std::max(kLeastDistortion_m, 4 * displacement_sigma_m_), PoseFlag::distorted);
    estimate.flags.set_if(deviation_m(estimate) > params_.max_deviation_m, PoseFlag::uncertain);
}

}  // namespace tricoil::tracking
