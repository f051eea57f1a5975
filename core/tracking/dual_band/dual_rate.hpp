// Dual-rate estimator: poses at the rate of the high band, without the bias that metal causes, from both bands' couplings.
#pragma once

#include <optional>

#include "core/base/status.hpp"
#include "core/field/general_dipole.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/dual_band/band_scalar.hpp"
#include "core/tracking/dual_band/split_filter.hpp"

namespace tricoil::tracking {

template <typename Scalar>
struct DualRateParams {
    Scalar row_period_s = Scalar(1) / 1500;          // of the high band
    int rows_per_line = 128;                         // high-band rows per low-band line
    std::optional<Scalar> scalar;                    // of the extrapolation to zero metal; empty: estimated from the data so far
    bool filter = true;                              // false: the last bias is held between low-band lines
    Vec3<Scalar> hemisphere = Vec3<Scalar>::Zero();  // of the first pose, source frame; zero: unknown
    Scalar max_misfit_share = Scalar(0.1);           // of the high band; beyond it no dipole explains the couplings
    Scalar max_sigma_m = Scalar(0.02);               // of the position per axis; beyond it the pose is not valid
    Scalar scalar_spread = Scalar(0.2);   // one scalar for all couplings leaves this share of the low band's own error: recorded
                                          // aluminium sheet, 0.026 of 0.13 mm
    Scalar misfit_share = Scalar(0.003);  // of the couplings: by how much the misfit of calibrated coils changes over the range;
                                          // it is equal in both bands (calibrated coils leave 0.3-0.8 %)
    Scalar split_spread = Scalar(0.2);  // sigma of the bias' change since the last line, relative to its largest plausible value
    SplitParams split;
};

template <typename Scalar>
struct DualRatePose {
    solver::RigidPose<Scalar> pose;
    Scalar position_sigma_m = 0;    // per axis
    Scalar rotation_sigma_rad = 0;  // per axis
    Scalar distortion_m = 0;        // by how much metal moves the high band's pose, as estimated
    bool solved = false;            // the high band's couplings fit a dipole
    bool valid = false;             // solved, and position_sigma_m within its limit
};

/// State: pose and rates, bias of the high band's pose and its rates. A low-band line is the mean over the last two lines'
/// periods of high-band rows: overlapping windows, as lock-in amplifiers with a window of two output periods give.
///
/// The bias is measured in couplings: mean of the low band's model at the high band's poses, corrected by the bias so far, minus
/// the low band's couplings. So a sensor that moves within the window causes no error, and only the error of the bias so far is
/// linearised. Between lines nothing measures the bias; see SplitFilter.
template <typename Scalar>
class DualRateEstimator {
public:
    /// Models of both bands in the same source and sensor frames, each with its own moments and sensitivities.
    DualRateEstimator(const field::GeneralDipole<Scalar>& high, const field::GeneralDipole<Scalar>& low,
                      const DualRateParams<Scalar>& params);

    /// One low-band line, before the high-band row of the same time. All rows_per_line rows since the last line must have been
    /// added. Errors: not_finite; degenerate (the couplings do not determine a pose). The line is then ignored.
    Status add_low(const Mat3<Scalar>& couplings);

    /// One high-band row. Errors: not_finite or degenerate couplings; the last pose then stays.
    Result<DualRatePose<Scalar>> add_high(const Mat3<Scalar>& couplings);

    [[nodiscard]] const BandScalar<Scalar>& scalar() const { return scalar_; }
    /// High band minus low band at the last line that was used, in m.
    [[nodiscard]] const Vec3<Scalar>& disagreement_m() const { return disagreement_m_; }

private:
    using Vec9 = Eigen::Matrix<Scalar, 9, 1>;
    using Jacobian = Eigen::Matrix<Scalar, 9, 6>;

    /// Sums over the high-band rows of one line.
    struct Line {
        Vec6<Scalar> expected = Vec6<Scalar>::Zero();   // disagreement of the bands, from the bias so far
        Mat3<Scalar> low_model = Mat3<Scalar>::Zero();  // low-band couplings at the high band's poses without it
        Jacobian jacobian = Jacobian::Zero();           // of them
        Vec9 high_residual = Vec9::Zero();              // of the high band's fit, in units of the low band
        Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
        Vec3<Scalar> rotation_rad = Vec3<Scalar>::Zero();
        int rows = 0;
    };

    struct Comparison;
    bool solve(const Mat3<Scalar>& couplings);
    bool cold_start(const Mat3<Scalar>& couplings);
    void start();
    void accumulate();
    Status compare(const Mat3<Scalar>& low, Comparison& result) const;
    void use(const Comparison& c);
    void fit_scalar(const Comparison& c);
    void close_line();
    [[nodiscard]] DualRatePose<Scalar> report() const;
    [[nodiscard]] Scalar sigma_of(Scalar variance, const Vec3<Scalar>& bias, const Vec3<Scalar>& change, Scalar appears) const;

    field::GeneralDipole<Scalar> high_;
    field::GeneralDipole<Scalar> low_;
    DualRateParams<Scalar> params_;
    Mat3<Scalar> gain_;  // low coupling per high coupling, by moments and sensitivities
    BandScalar<Scalar> scalar_;
    SplitFilter<Scalar> position_;
    SplitFilter<Scalar> rotation_;

    bool tracking_ = false;                           // a high-band pose is known
    bool solved_ = false;                             // for the last row
    solver::RigidPose<Scalar> high_pose_;             // of the high band alone
    Vec3<Scalar> turned_rad_ = Vec3<Scalar>::Zero();  // sum of its small rotations since the start, source frame
    Mat3<Scalar> high_misfit_ = Mat3<Scalar>::Zero();
    Mat3<Scalar> last_misfit_ = Mat3<Scalar>::Zero();
    Scalar high_variance_ = 0;  // of one high coupling
    Scalar position_variance_ = 0;
    Scalar rotation_variance_ = 0;
    Line this_line_;
    Line last_line_;

    Vec3<Scalar> end_position_m_ = Vec3<Scalar>::Zero();  // high band, at the end of the last line
    Vec3<Scalar> end_turned_rad_ = Vec3<Scalar>::Zero();
    Vec3<Scalar> line_position_m_ = Vec3<Scalar>::Zero();  // at the time of the bias
    Vec3<Scalar> line_turned_rad_ = Vec3<Scalar>::Zero();
    Vec3<Scalar> held_bias_m_ = Vec3<Scalar>::Zero();  // as measured at the last line
    Vec3<Scalar> held_bias_rad_ = Vec3<Scalar>::Zero();
    Vec3<Scalar> disagreement_m_ = Vec3<Scalar>::Zero();
    Scalar low_variance_ = 0;  // of one low coupling
    bool compared_ = false;
    Vec3<Scalar> last_low_m_ = Vec3<Scalar>::Zero();
    Vec3<Scalar> last_disagreement_m_ = Vec3<Scalar>::Zero();
    Vec9 last_low_redundant_ = Vec9::Zero();
    Vec9 last_high_redundant_ = Vec9::Zero();
};

extern template class DualRateEstimator<double>;

}  // namespace tricoil::tracking
