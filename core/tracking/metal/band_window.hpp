// Comparison of both bands over the last frames.
#pragma once

#include <array>

#include "core/base/assertion.hpp"
#include "core/tracking/metal/signal_ratios.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Couplings of the low band compared with their model at a pose, which is that of the high band minus `offset`.
struct BandFrame {
    Vec9 excess = Vec9::Zero();  // model minus low band
    PoseJacobian jacobian = PoseJacobian::Zero();
    Vec6<double> offset = Vec6<double>::Zero();  // position (m), small rotation (rad), source frame
    Vec9 high_misfit = Vec9::Zero();
    Vec9 low_quadrature = Vec9::Zero();
    Vec9 high_quadrature = Vec9::Zero();
    Vec9 high = Vec9::Zero();  // couplings; means do not contain them
    double low_variance = 0;   // of one low coupling

    void add(const BandFrame& other, double weight) {
        excess += weight * other.excess;
        jacobian += weight * other.jacobian;
        offset += weight * other.offset;
        high_misfit += weight * other.high_misfit;
        low_quadrature += weight * other.low_quadrature;
        high_quadrature += weight * other.high_quadrature;
        low_variance += weight * weight * other.low_variance;
    }
};

/// The signals of metal (MetalSignals) as changes of the pose, to first order, and their misfits: the parts of the couplings that
/// no pose explains.
struct BandComparison {
    Matrix<double, 6, 3> pose;  // column i: by signal i; the last one is the pose of the high band minus that of the low band
    SignalCouplings misfit;
    Vec9 high_misfit;
    Mat6<double> covariance;  // of a pose for unit noise of each coupling
    double low_variance;

    explicit BandComparison(const BandFrame& mean, double range_m)
        : covariance(unit_covariance(mean.jacobian, range_m)), low_variance(mean.low_variance) {
        const auto pose_of = [&](const Vec9& v) -> Vec6<double> { return covariance * (mean.jacobian.transpose() * v); };
        const auto misfit_of = [&](const Vec9& v) -> Vec9 { return v - mean.jacobian * pose_of(v); };
        high_misfit = misfit_of(mean.high_misfit);
        pose << pose_of(mean.low_quadrature), pose_of(mean.high_quadrature), mean.offset + pose_of(mean.excess);
        misfit << misfit_of(mean.low_quadrature), misfit_of(mean.high_quadrature), high_misfit + misfit_of(mean.excess);
    }

    [[nodiscard]] Vec9 low_misfit() const { return high_misfit - misfit.col(2); }
};

/// Means over the last `frames` frames. Hum in the low band is much larger than its noise, but adds to the couplings of the
/// sensor's coils in the same way in motion and at rest: a mean over a whole number of mains cycles contains none.
class BandWindow {
public:
    explicit BandWindow(int frames) : frames_(frames) {
        TRICOIL_ASSERT(frames >= 2 && frames <= DualBandParams::kMaxWindowFrames);
    }

    void clear() { count_ = 0; }
    void add(const BandFrame& frame) {
        ring_[static_cast<std::size_t>(count_ % kStored)] = frame;
        ++count_;
    }
    [[nodiscard]] int frames() const { return frames_; }
    /// True if mean(age) exists.
    [[nodiscard]] bool has_mean(int age = 0) const { return count_ >= frames_ + age; }
    /// Of the window that ended `age` frames ago, at most half a window.
    [[nodiscard]] BandFrame mean(int age = 0) const {
        BandFrame mean;
        for (int n = age + 1; n <= age + frames_; ++n) {
            mean.add(frame(n), 1.0 / frames_);
        }
        return mean;
    }

    /// Change of the high band's couplings over mean().
    [[nodiscard]] Vec9 change() const { return frame(1).high - frame(frames_).high; }

private:
    [[nodiscard]] const BandFrame& frame(int age) const { return ring_[static_cast<std::size_t>((count_ - age) % kStored)]; }

    static constexpr int kStored = DualBandParams::kMaxWindowFrames + DualBandParams::kMaxWindowFrames / 2;

    int frames_;
    long count_ = 0;
    std::array<BandFrame, kStored> ring_{};
};

}  // namespace tricoil::tracking
