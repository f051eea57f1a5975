// Bias of the high band's pose by metal, from couplings of both bands.
#pragma once

#include <optional>

#include "core/field/general_dipole.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/metal/band_share.hpp"
#include "core/tracking/metal/band_window.hpp"
#include "core/tracking/metal/metal_spectrum.hpp"

namespace tricoil::tracking {

struct ComplexCouplings {
    Mat3<double> in_phase = Mat3<double>::Zero();
    Mat3<double> quadrature = Mat3<double>::Zero();
};

/// A bias as it is to be subtracted: zero if it is within the noise of the low band.
struct Bias {
    Vec3<double> value = Vec3<double>::Zero();
    double magnitude = 0;  // estimated length of the true bias, also where `value` is zero
    double sigma = 0;      // standard deviation of `value` per axis
};

/// Position (m) and small rotation (rad), source frame. The covariance is that of the values; the noise of the high band is not
/// in it.
struct MetalBiasEstimate {
    Bias position_m;
    Bias rotation_rad;
    Mat6<double> covariance = Mat6<double>::Zero();
};

/// Each frame gives the difference of the bands' poses: the low band's couplings minus their model at the high band's pose, to
/// first order. Motion is the same in both bands, so only metal and noise are left. From the means over a window the bias of the
/// high band follows in the better of two ways, and is then extrapolated to the present:
/// - MetalSpectrum, if the quadratures are known and the metal is not magnetic: a sum of the quadratures and the difference.
/// - BandShare: the difference, divided by 1 - share.
/// Sigma contains the noise of the low band, the error of the extrapolation and of the spectrum or share, and metal that the
/// misfit of the high band shows since the window.
///
/// Metal that comes or goes within one frame starts a new window.
class MetalBias {
public:
    /// common: of corrected columns, with the quadrature floor of both bands; 1: unknown, quadratures are not used.
    MetalBias(const CommonParams<double>& common, const DualBandParams& bands);

    /// One frame of the high band, with the pose that solves it.
    void add_high(const ComplexCouplings& couplings, const solver::RigidPose<double>& pose);
    /// The low band's frame of the same time, after add_high(). sigma: of a coupling.
    void add_low(const ComplexCouplings& couplings, double sigma);
    /// Forgets all frames. Call it after lost frames, because hum is zero only in the mean over consecutive ones.
    void clear();

    /// At the newest frame of the high band; nullopt before the first window is full.
    [[nodiscard]] std::optional<MetalBiasEstimate> estimate() const;
    [[nodiscard]] const BandShare& share() const { return share_; }

private:
    /// To the effect on the high band: weights of the signals and their errors.
    struct Extrapolation {
        Vec3<double> weights;
        double variance = 0;        // of a coupling
        double relative_error = 0;  // of the bias
    };

    [[nodiscard]] bool misfit_jumps() const;
    [[nodiscard]] BandComparison comparison(int age) const;
    [[nodiscard]] MetalSignals noise(const BandComparison& window) const;
    [[nodiscard]] Extrapolation by_share() const;
    [[nodiscard]] Extrapolation by_spectrum(const BandComparison& window) const;
    [[nodiscard]] Extrapolation extrapolation(const BandComparison& window) const;
    [[nodiscard]] double new_misfit_variance(const BandComparison& window) const;
    [[nodiscard]] double difference_ratio() const;
    [[nodiscard]] double strength() const;
    [[nodiscard]] bool rests() const;

    CommonParams<double> common_;
    DualBandParams bands_;
    field::GeneralDipole<double> model_;
    BandWindow window_;
    BandShare share_;
    SignalRatios ratios_;
    std::optional<MetalSpectrum> spectrum_;
    Mat3<double> high_quadrature_ = Mat3<double>::Zero();
    Vec9 high_ = Vec9::Zero();
    solver::RigidPose<double> pose_;
    Vec9 misfit_ = Vec9::Zero();  // of the high band
    Vec9 last_misfit_ = Vec9::Zero();
    double high_variance_ = 0;  // of one high coupling
    double systematic_ = 0;     // error of a low coupling that no mean reduces
    int changes_ = 0;           // of its misfit from frame to frame that high_variance_ contains
    bool has_frame_ = false;    // of the high band since clear()
};

}  // namespace tricoil::tracking
