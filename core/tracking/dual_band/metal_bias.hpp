// Bias of the high band's pose by metal, from couplings of both bands.
#pragma once

#include <optional>

#include "core/field/general_dipole.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/dual_band/band_share.hpp"
#include "core/tracking/dual_band/band_window.hpp"

namespace tricoil::tracking {

struct MetalBiasParams {
    double coupling_constant = 1;
    int window_frames = 24;   // a whole number of mains cycles
    double misfit_floor = 0;  // misfit of calibrated coils per coupling, relative to the coupling strength k
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
/// first order. Motion is the same in both bands, so only metal and noise are left. The mean difference over a window,
/// extrapolated to the present and divided by 1 - share (BandShare), is the bias. Sigma contains the noise of the low band, the
/// error of the extrapolation and of the share, and metal that the misfit of the high band shows since the window.
///
/// Metal that comes or goes within one frame starts a new window.
class MetalBias {
public:
    explicit MetalBias(const MetalBiasParams& params);

    /// One frame of the high band, with the pose that solves it.
    void add_high(const Mat3<double>& couplings, const solver::RigidPose<double>& pose);
    /// The low band's frame of the same time, after add_high(). sigma: of a coupling.
    void add_low(const Mat3<double>& couplings, double sigma);
    /// Forgets all frames. Call it after lost frames, because hum is zero only in the mean over consecutive ones.
    void clear();

    /// At the newest frame of the high band; nullopt before the first window is full.
    [[nodiscard]] std::optional<MetalBiasEstimate> estimate() const;
    [[nodiscard]] const BandShare& share() const { return share_; }

private:
    [[nodiscard]] bool misfit_jumps() const;
    [[nodiscard]] BandDifference difference(int age) const;
    [[nodiscard]] double new_misfit_variance(const BandDifference& window) const;

    MetalBiasParams params_;
    field::GeneralDipole<double> model_;
    BandWindow window_;
    BandShare share_;
    solver::RigidPose<double> pose_;
    Vec9 misfit_ = Vec9::Zero();  // of the high band
    Vec9 last_misfit_ = Vec9::Zero();
    double high_variance_ = 0;  // of one high coupling
    double systematic_ = 0;     // error of a low coupling that no mean reduces
    int changes_ = 0;           // of its misfit from frame to frame that high_variance_ contains
    bool has_frame_ = false;    // of the high band since clear()
};

}  // namespace tricoil::tracking
