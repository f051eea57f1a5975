#include "core/tracking/dual_band/band_correction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/rotations.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kOverlap = 1.3;           // consecutive windows share noise
constexpr double kQuadratureFloor = 1e-4;  // relative to k: phases of the channels
constexpr double kLeakage_s = 1e-4;        // quadrature from motion, between the carriers
constexpr double kQuadratureShare = 0.1;   // noise of the high band's quadrature in a window relative to the low band's
constexpr double kMostChange = 1;
constexpr double kChangeKept = 0.97;  // per block
constexpr int kMaxAgeBlocks = 24;     // without a low-band matrix the state is lost
constexpr double kLeastDistortion_m = 1e-3;

/// With Y = O^T X in axes along and across the line of sight, a pose explains all changes but those of the trace, of Y22 - Y33,
/// and of Y23 + Y32. Rows: these numbers; columns: entries of Y in column order.
Eigen::Matrix<double, 3, 9> redundant_numbers(const Vec3<double>& direction) {
    const Eigen::Matrix<double, 3, 2> e = geometry::transverse_axes(direction);
    const Mat3<double> trace = Mat3<double>::Identity() / std::sqrt(3.0);
    const Mat3<double> square = (e.col(0) * e.col(0).transpose() - e.col(1) * e.col(1).transpose()) / std::sqrt(2.0);
    const Mat3<double> diagonal = (e.col(0) * e.col(1).transpose() + e.col(1) * e.col(0).transpose()) / std::sqrt(2.0);
    Eigen::Matrix<double, 3, 9> rows;
    rows << trace.reshaped().transpose(), square.reshaped().transpose(), diagonal.reshaped().transpose();
    return rows;
}

}  // namespace

BandCorrection::BandCorrection(const BandCorrectionParams& params) : params_(params) {
    pose_by_coupling_.setZero();
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

bool BandCorrection::gather(const signal::Columns<double>& columns, Block& block) {
    if (columns.size() != kSourceCoils) {
        return false;
    }
    block.variance = 0;
    for (const Column<double>& column : columns) {
        const auto index = static_cast<Eigen::Index>(coil_index(column.state));
        if (index < 0 || column.flags.has_any(kUnusableFlags) || !column.in_phase.allFinite()) {
            return false;
        }
        block.in_phase.col(index) = column.in_phase;
        block.quadrature.col(index) = column.quadrature;
        block.variance += column.sigma.squaredNorm() / 9;
    }
    return true;
}

void BandCorrection::correct(signal::Columns<double>& columns, const std::optional<signal::LowBandMatrix>& low) {
    predict();
    Block block;
    if (!gather(columns, block) || !find_pose(block)) {
        filled_ = 0;
        return;
    }
    add_high(block);
    blocks_[next_] = block;
    next_ = (next_ + 1) % static_cast<std::size_t>(params_.low_band.window_blocks);
    filled_ = std::min(filled_ + 1, params_.low_band.window_blocks);
    if (low && filled_ == params_.low_band.window_blocks) {
        add_low(*low);
    }
    if (!ready_) {
        return;
    }
    estimate(block);
    const Mat3<double> corrected = block.in_phase - block.attitude * effect_.mean;
    for (Column<double>& column : columns) {
        column.in_phase = corrected.col(coil_index(column.state));
    }
}

void BandCorrection::predict() {
    if (++age_ > kMaxAgeBlocks) {
        started_ = false;
        ready_ = false;
        effect_ = {};
    }
    if (started_) {
        window_.predict(params_.low_band.block_s());
        now_.predict(params_.low_band.block_s());
    }
}

/// Metal turns the attitude slightly, so it is found from couplings that are corrected with the last attitude.
bool BandCorrection::find_pose(Block& block) {
    Mat3<double> x = block.in_phase;
    for (int pass = 0; pass < (ready_ ? 2 : 1); ++pass) {
        const auto pose = solver::solve_direct<double>(x, params_.coupling_constant);
        if (!pose.ok() || !pose->right_handed) {
            return false;
        }
        block.attitude = pose->attitude;
        position_m_ = pose->range_m * pose->direction;
        x = block.in_phase - block.attitude * effect_.mean;
    }
    if (!started_) {
        const double range = position_m_.norm();
        const double strength = field::coupling_strength(params_.coupling_constant, range);
        window_.start(strength);
        now_.start(strength);
        started_ = true;
        age_ = 0;
    }
    return true;
}

/// Motion induces the voltage dX/dt I, a quarter turn from that of the current's derivative.
void BandCorrection::add_high(Block& block) {
    if (filled_ == 0) {
        return;
    }
    const Mat3<double> rate = (block.in_phase - block_before(0).in_phase) / params_.low_band.block_s();
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        block.quadrature.col(j) += rate.col(j) / (2 * std::numbers::pi * params_.high_hz[static_cast<std::size_t>(j)]);
    }
    const double floor = kQuadratureFloor * field::coupling_strength(params_.coupling_constant, position_m_.norm());
    const double variance = block.variance + floor * floor + kLeakage_s * kLeakage_s * rate.squaredNorm() / 9;
    now_.correct({block.attitude.transpose() * block.quadrature - now_.value(0)}, 0, variance);
}

void BandCorrection::add_low(const signal::LowBandMatrix& low) {
    const double dt = params_.low_band.block_s();
    const int count = params_.low_band.window_blocks;
    Mat3<double> difference = -low.in_phase;
    Mat3<double> low_quadrature = low.quadrature;
    Mat3<double> high_quadrature = Mat3<double>::Zero();
    Mat3<double> rate = Mat3<double>::Zero();
    for (int n = 0; n < count; ++n) {  // n: age in blocks
        const auto i = static_cast<std::size_t>(n);
        const Block& block = block_before(n);
        difference += mean_weights_[i] * block.in_phase - weights_[i] * block.attitude * window_.before(0, n * dt);
        low_quadrature -= weights_[i] * block.attitude * window_.before(1, n * dt);
        high_quadrature += mean_weights_[i] * block.quadrature - weights_[i] * block.attitude * window_.before(2, n * dt);
        rate += rate_weights_[i] * block.in_phase;
    }
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        low_quadrature.col(j) += rate.col(j) / (2 * std::numbers::pi * params_.low_band.tone_hz(static_cast<std::size_t>(j)));
    }
    const double floor = kQuadratureFloor * field::coupling_strength(params_.coupling_constant, position_m_.norm());
    const double variance = kOverlap * low.sigma.squaredNorm() / 9 + floor * floor;
    const Mat3<double> to_source = block_before(count / 2).attitude.transpose();
    window_.correct({to_source * difference, to_source * low_quadrature, to_source * high_quadrature}, 0.5 * (count - 1) * dt,
                    variance);
    age_ = 0;
    ready_ = true;
}

void BandCorrection::estimate(const Block& block) {
    MetalEvidence evidence;
    evidence.predicted = {window_.value(0), window_.value(1), window_.value(2)};
    evidence.high_quadrature = now_.value(0);
    const double noise = window_.variance();
    evidence.variance << noise, noise, kQuadratureShare * noise + now_.variance(), now_.variance();
    const double error = (now_.value(0) - window_.value(2)).squaredNorm() / now_.value(0).squaredNorm();
    change_ = std::max(std::min(error, kMostChange), kChangeKept * change_);
    evidence.change = change_;
    const Mat3<double> in_source = block.attitude.transpose() * block.in_phase;
    evidence.redundant_of_effect = redundant_numbers(position_m_.normalized());
    evidence.redundant = evidence.redundant_of_effect * in_source.reshaped();
    evidence.redundant_variance = block.variance;
    effect_ = estimator_.estimate(evidence);
    const auto jacobian = field::signal_matrix_jacobian<double>(params_.coupling_constant, position_m_, Mat3<double>::Identity());
    const Mat6<double> square = jacobian.transpose() * jacobian;
    pose_by_coupling_ = square.inverse() * jacobian.transpose();
    const Eigen::Matrix<double, 3, 9> position = pose_by_coupling_.topRows<3>();
    const double variance = (position * effect_.covariance * position.transpose()).trace();
    if (!(variance < params_.max_deviation_m * params_.max_deviation_m)) {
        // An uncertain correction would lead the next attitude astray. The pose is invalid; it keeps the error of one band.
        effect_.covariance += effect_.mean.reshaped() * effect_.mean.reshaped().transpose();
        effect_.mean.setZero();
    }
}

void BandCorrection::finish(PoseEstimate<double>& estimate) const {
    if (!ready_) {
        estimate.flags.set(PoseFlag::uncertain);
        return;
    }
    // The opposite position has the same couplings; its derivative by position has the other sign.
    Eigen::Matrix<double, 6, 9> by_coupling = pose_by_coupling_;
    if (estimate.position_m.dot(position_m_) < 0) {
        by_coupling.topRows<3>() *= -1;
    }
    const Mat6<double> covariance = by_coupling * effect_.covariance * by_coupling.transpose();
    estimate.covariance += covariance;
    const double displacement_m = (by_coupling.topRows<3>() * effect_.mean.reshaped()).norm();
    const double sigma_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
    estimate.distortion_m = std::max(estimate.distortion_m, displacement_m);
    estimate.flags.set_if(displacement_m > std::max(kLeastDistortion_m, 4 * sigma_m), PoseFlag::distorted);
    estimate.flags.set_if(deviation_m(estimate) > params_.max_deviation_m, PoseFlag::uncertain);
}

}  // namespace tricoil::tracking
