// Removes the effect of metal from the columns of the high band, from couplings of both bands.
#pragma once

#include <array>
#include <complex>
#include <optional>

#include "core/signal/low_band.hpp"
#include "core/tracking/dual_band/metal_signature.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::tracking {

/// Columns with one of these flags cannot be compared with the low band.
constexpr ColumnFlags kUnusableFlags{ColumnFlag::saturated,    ColumnFlag::clipped,   ColumnFlag::stuck,
                                     ColumnFlag::no_reference, ColumnFlag::dc_offset, ColumnFlag::overrun,
                                     ColumnFlag::gain_changed};

struct BandCorrectionParams {
    MetalSignature::Tones high_hz{};
    signal::LowBandPlan low_band;
    double coupling_constant = 1;   // C, coupling units times m^3
    double max_deviation_m = 0.02;  // standard deviation of the position above which a pose is invalid
};

/// State: difference of the bands (high - low, in phase) that metal causes, and its rate, as a field in the source frame. There
/// it does not change if the sensor turns. The high band's own effect is this difference times the gain of MetalSignature.
class BandCorrection {
public:
    explicit BandCorrection(const BandCorrectionParams& params);

    /// Subtracts the effect of metal from the three columns of one block. low: the matrix whose window ends with this block.
    /// Columns with a fault of the signal are not changed.
    void correct(signal::Columns<double>& columns, const std::optional<signal::LowBandMatrix>& low);

    /// Adds the uncertainty of the correction to a pose from corrected columns, and reports the displacement by metal.
    void finish(PoseEstimate<double>& estimate) const;

    [[nodiscard]] const MetalSignature& signature() const { return signature_; }

private:
    static constexpr int kMaxBlocks = signal::LowBandPlan::kMaxWindowBlocks;
    struct Block {
        Mat3<double> in_phase;
        Mat3<double> quadrature;
        Mat3<double> attitude;  // O: source components to sensor components
    };

    [[nodiscard]] const Block& block_before(int count) const;
    [[nodiscard]] Mat3<double> effect() const { return difference_ * signature_.gain().asDiagonal(); }
    bool find_attitude(Block& block);
    void predict();
    void add_low(const signal::LowBandMatrix& low, double high_variance);
    [[nodiscard]] Mat3<double> weighted_innovation(const BandEvidence& evidence, const Mat3<double>& expected,
                                                   double& variance) const;
    void add_redundant(const Block& block, BandEvidence& evidence) const;
    void correct_state(const Mat3<double>& innovation, double age_s, double variance);
    void update_uncertainty(const Block& block, const Mat3<double>& corrected);

    BandCorrectionParams params_;
    MetalSignature signature_;
    std::array<double, kMaxBlocks> weights_{};       // of the blocks of a window, the newest first
    std::array<double, kMaxBlocks> mean_weights_{};  // the same for means of blocks
    std::array<double, kMaxBlocks> rate_weights_{};  // mean rate of change, 1/s
    std::array<Block, kMaxBlocks> blocks_{};         // ring
    std::size_t next_ = 0;
    int filled_ = 0;
    Mat3<double> attitude_ = Mat3<double>::Identity();
    bool attitude_known_ = false;

    Mat3<double> difference_ = Mat3<double>::Zero();
    Mat3<double> rate_ = Mat3<double>::Zero();
    double variance_ = 0;    // of an entry of the difference
    double covariance_ = 0;  // with its rate
    double rate_variance_ = 0;
    double process_noise_ = 0;  // coupling units squared / s^3
    double consistency_ = 1;    // mean squared innovation over its variance
    double strength_ = 0;       // k of the last block
    bool started_ = false;

    double effect_sigma_ = 0;    // standard deviation of an entry of the correction
    double displacement_m_ = 0;  // of the high band's position by metal
    double displacement_sigma_m_ = 0;
};

}  // namespace tricoil::tracking
