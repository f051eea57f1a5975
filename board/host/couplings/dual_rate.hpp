// Dual-rate estimator: poses at the rate of the high band, without the bias that metal causes, from both bands' couplings.
#pragma once

#include <optional>

#include "board/host/couplings/band_scalar.hpp"
#include "board/host/couplings/split_filter.hpp"
#include "core/base/status.hpp"
#include "core/field/general_dipole.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/metal/pose_information.hpp"

namespace tricoil::host {

struct DualRateParams {
    double row_period_s = 1.0 / 1500;                // of the high band
    int rows_per_line = 128;                         // high-band rows per low-band line
    std::optional<double> scalar;                    // of the extrapolation to zero metal; empty: estimated from the data so far
    bool filter = true;                              // false: the last bias is held between low-band lines
    Vec3<double> hemisphere = Vec3<double>::Zero();  // of the first pose, source frame; zero: unknown
    double max_misfit_share = 0.1;                   // of the high band; beyond it no dipole explains the couplings
    double max_sigma_m = 0.02;                       // of the position per axis; beyond it the pose is not valid
    /// Share of the low band's error that remains, because one scalar serves all couplings: 0.026 of 0.13 mm (recorded aluminium
    /// sheet).
    double scalar_spread = 0.2;
    /// Variation of the misfit of calibrated coils over the range, as a share of the couplings. It is equal in both bands
    /// (calibrated coils leave 0.3-0.8 %).
    double misfit_share = 0.003;
    double split_spread = 0.2;  // sigma of the bias' change since the last line, relative to its largest plausible value
    SplitParams split;
};

struct DualRatePose {
    solver::RigidPose<double> pose;
    double position_sigma_m = 0;    // per axis
    double rotation_sigma_rad = 0;  // per axis
    double distortion_m = 0;        // estimated displacement of the high band's pose by metal
    bool solved = false;            // the high band's couplings fit a dipole
    bool valid = false;             // solved, and position_sigma_m within its limit
};

/// State: pose and rates, bias of the high band's pose and its rates. A low-band line is a mean over two line periods, so
/// the windows of consecutive lines overlap, as in lock-in amplifiers whose window is two output periods.
///
/// The bias is measured in couplings: mean of the low band's model at the high band's poses, corrected by the bias so far, minus
/// the low band's couplings. Therefore motion within the window causes no error, and only the error of the bias so far
/// is linearised. Between lines nothing measures the bias; see SplitFilter.
class DualRateEstimator {
public:
    /// Models of both bands in the same source and sensor frames, each with its own moments and sensitivities.
    DualRateEstimator(const field::GeneralDipole<double>& high, const field::GeneralDipole<double>& low,
                      const DualRateParams& params);

    /// Adds one low-band line. Call it before add_high() of the same time. The line is ignored if a high-band row of the last two
    /// lines is missing, or after an error. Errors: not_finite; degenerate (the couplings do not determine a pose).
    Status add_low(const Mat3<double>& couplings);

    /// Adds one high-band row. Errors: not_finite or degenerate couplings; the last pose then stays.
    Result<DualRatePose> add_high(const Mat3<double>& couplings);

    [[nodiscard]] const BandScalar& scalar() const { return scalar_; }

private:
    /// Sums over the high-band rows of one line.
    struct Line {
        Vec6<double> expected = Vec6<double>::Zero();   // disagreement of the bands expected from the bias so far
        Mat3<double> low_model = Mat3<double>::Zero();  // low-band couplings at the poses corrected by the bias so far
        tracking::PoseJacobian jacobian = tracking::PoseJacobian::Zero();  // of low_model
        tracking::Vec9 high_residual = tracking::Vec9::Zero();             // of the high band's fit, in units of the low band
        Vec3<double> position_m = Vec3<double>::Zero();
        Vec3<double> rotation_rad = Vec3<double>::Zero();
        int rows = 0;
    };

    struct Comparison;
    bool solve(const Mat3<double>& couplings);
    bool cold_start(const Mat3<double>& couplings);
    void start();
    void accumulate();
    Status compare(const Mat3<double>& low, Comparison& result) const;
    void use(const Comparison& c);
    void fit_scalar(const Comparison& c);
    void close_line();
    [[nodiscard]] DualRatePose report() const;
    [[nodiscard]] double sigma_of(double variance, const Vec3<double>& bias, const Vec3<double>& change, double appears) const;

    field::GeneralDipole<double> high_;
    field::GeneralDipole<double> low_;
    DualRateParams params_;
    Mat3<double> gain_;  // low coupling per high coupling, by moments and sensitivities
    BandScalar scalar_;
    SplitFilter position_;
    SplitFilter rotation_;

    bool tracking_ = false;                           // a high-band pose is known
    bool solved_ = false;                             // for the last row
    solver::RigidPose<double> high_pose_;             // of the high band alone
    Vec3<double> turned_rad_ = Vec3<double>::Zero();  // sum of its small rotations since the start, source frame
    Mat3<double> high_misfit_ = Mat3<double>::Zero();
    Mat3<double> last_misfit_ = Mat3<double>::Zero();
    double high_variance_ = 0;  // of one high coupling
    double position_variance_ = 0;
    double rotation_variance_ = 0;
    Line this_line_;
    Line last_line_;

    Vec3<double> end_position_m_ = Vec3<double>::Zero();  // high band, at the end of the last line
    Vec3<double> end_turned_rad_ = Vec3<double>::Zero();
    Vec3<double> line_position_m_ = Vec3<double>::Zero();  // high band, at the time for which the bias is valid
    Vec3<double> line_turned_rad_ = Vec3<double>::Zero();
    Vec3<double> held_bias_m_ = Vec3<double>::Zero();  // as measured at the last line
    Vec3<double> held_bias_rad_ = Vec3<double>::Zero();
    Vec3<double> disagreement_m_ = Vec3<double>::Zero();  // high band minus low band at the last line that was used
    double low_variance_ = 0;                             // of one low coupling
    bool compared_ = false;
    Vec3<double> last_low_m_ = Vec3<double>::Zero();
    Vec3<double> last_disagreement_m_ = Vec3<double>::Zero();
    tracking::Vec9 last_low_redundant_ = tracking::Vec9::Zero();
    tracking::Vec9 last_high_redundant_ = tracking::Vec9::Zero();
};

}  // namespace tricoil::host
