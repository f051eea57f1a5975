// Removes the effect of metal from the columns of the high band, from couplings of both bands.
#pragma once

#include <array>
#include <optional>

#include "core/signal/demodulator.hpp"
#include "core/signal/low_band.hpp"
#include "core/tracking/dual_band/field_track.hpp"
#include "core/tracking/dual_band/metal_effect.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::tracking {

/// Columns with one of these flags cannot be compared with the low band.
constexpr ColumnFlags kUnusableFlags{ColumnFlag::saturated,    ColumnFlag::clipped,   ColumnFlag::stuck,
                                     ColumnFlag::no_reference, ColumnFlag::dc_offset, ColumnFlag::overrun,
                                     ColumnFlag::gain_changed};

struct BandCorrectionParams {
    std::array<double, kSourceCoils> high_hz{};
    signal::LowBandPlan low_band;
    double coupling_constant = 1;   // C, coupling units times m^3
    double max_deviation_m = 0.02;  // standard deviation of the position above which a pose is invalid
};

/// State: what the bands show of metal, as fields in the source frame. There they do not change if the sensor turns.
class BandCorrection {
public:
    explicit BandCorrection(const BandCorrectionParams& params);

    /// Subtracts the effect of metal from the three columns of one block. low: the matrix whose window ends with this block.
    /// Columns with a fault of the signal are not changed.
    void correct(signal::Columns<double>& columns, const std::optional<signal::LowBandMatrix>& low);

    /// Adds the uncertainty of the correction to a pose from corrected columns, and reports the displacement by metal.
    void finish(PoseEstimate<double>& estimate) const;

private:
    static constexpr int kMaxBlocks = signal::LowBandPlan::kMaxWindowBlocks;
    struct Block {
        Mat3<double> in_phase;
        Mat3<double> quadrature;  // without the part that motion induces
        Mat3<double> attitude;    // O: source components to sensor components
        double variance;          // of a coupling
    };

    [[nodiscard]] const Block& block_before(int count) const;
    static bool gather(const signal::Columns<double>& columns, Block& block);
    bool find_pose(Block& block);
    void predict();
    void add_high(Block& block);
    void add_low(const signal::LowBandMatrix& low);
    void estimate(const Block& block);

    BandCorrectionParams params_;
    std::array<double, kMaxBlocks> weights_{};       // of the blocks of a window, the newest first
    std::array<double, kMaxBlocks> mean_weights_{};  // the same for means of blocks
    std::array<double, kMaxBlocks> rate_weights_{};  // mean rate of change, 1/s
    std::array<Block, kMaxBlocks> blocks_{};         // ring
    std::size_t next_ = 0;
    int filled_ = 0;
    int age_ = 0;  // blocks since the last low-band matrix
    bool started_ = false;
    bool ready_ = false;  // a low-band matrix has come

    FieldTrack<3> window_;  // from windows of the low band: difference of the bands, quadrature of the low and of the high band
    FieldTrack<1> now_;     // quadrature of the high band, from each block
    double change_ = 0;     // of MetalEvidence
    MetalEstimator estimator_;
    MetalEffect effect_;

    Vec3<double> position_m_ = Vec3<double>::Zero();  // of the last block; its sign is undetermined
    Eigen::Matrix<double, 6, 9> pose_by_coupling_;    // source frame
};

}  // namespace tricoil::tracking
