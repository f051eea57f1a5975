// Tracker for two bands: poses at the frame rate, with the error that metal causes removed.
#pragma once

#include "core/tracking/matrix/matrix_tracker.hpp"
#include "core/tracking/metal/mean_quadrature.hpp"
#include "core/tracking/metal/metal_bias.hpp"

namespace tricoil::tracking {

/// Standard deviation of a coupling of the pose by noise.
double coupling_noise(const PoseEstimate<double>& estimate, double coupling_constant);

/// The direct solver solves the high band and decides signal, hemisphere and continuity. MetalBias compares it with the low
/// band. The pose is that of both bands, or that of the high band with the bias as an additional error, whichever has the smaller
/// standard deviation. `distorted`: also if the bias exceeds five standard deviations.
class DualBandTracker final : public MatrixTracker<double> {
public:
    /// Errors (invalid_argument) of a correction that this tracker cannot use: surroundings are known for the high band only.
    static Status check(const Correction& correction) {
        if (correction && !correction->surroundings().empty()) {
            return {StatusCode::invalid_argument,
                    "surroundings are calibrated for one band; two bands need a calibration without them"};
        }
        return {};
    }

    /// `params` must pass tracking::check() and hold DualBandParams; `correction` must pass check().
    explicit DualBandTracker(const TrackerParams<double>& params, const Correction& correction = std::nullopt);

private:
    void do_update_low(const Column<double>& column) override;
    void do_refine(const SignalMatrixAssembler<double>& columns, PoseEstimate<double>& estimate) override;
    void do_set_hemisphere(const Vec3<double>& towards) override;

    void follow(const Mat3<double>& quadrature, const PoseEstimate<double>& high);
    bool correct(const MetalBiasEstimate& bias, PoseEstimate<double>& estimate) const;
    void cover_hidden_metal(const std::optional<MetalBiasEstimate>& bias, PoseEstimate<double>& estimate) const;
    [[nodiscard]] Mat6<double> noise_covariance(const PoseEstimate<double>& estimate) const;
    [[nodiscard]] Mat6<double> covariance_for(double sigma, const PoseEstimate<double>& estimate) const;
    [[nodiscard]] double strength(const PoseEstimate<double>& estimate) const;

    double frame_s_;
    MetalBias bias_;
    MeanQuadrature mean_quadrature_;
    SignalMatrixAssembler<double> low_{Microseconds{0}};
    bool awaits_low_ = false;  // the newest frame of the high band is usable, and its low band has not come
    DeviceTime last_frame_{};
    Vec3<double> last_position_m_ = Vec3<double>::Zero();
};

}  // namespace tricoil::tracking
