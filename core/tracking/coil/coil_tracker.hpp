// Tracker for a body with one to three sensor coils in the field of a generator of N coils that are driven in turn: the filter of
// scaat/ with an update for the couplings to each generator coil, at their own time. No heap.
#pragma once

#include <bit>
#include <numbers>

#include "core/geometry/angles.hpp"
#include "core/solver/single_coil.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/scaat/acquisition.hpp"
#include "core/tracking/scaat/adaptation.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking {

/// Sensor coil on a body, sensor frame. A gain of zero is unknown, and estimated; only that of a single coil.
template <typename Scalar>
struct BodyCoil {
    Vec3<Scalar> offset_m = Vec3<Scalar>::Zero();
    Vec3<Scalar> axis = Vec3<Scalar>::UnitX();
    Scalar gain = 0;
};

/// Couplings of the coils of a body to one generator coil, with their standard deviations. Unused entries are zero.
template <typename Scalar>
struct GeneratorColumn {
    std::size_t source = 0;
    DeviceTime midpoint{};  // of the demodulation window
    Vec3<Scalar> in_phase, sigma;
};

/// Field of a generator at the coils of a body. Rows beyond the coils are zero. A rotation of a single coil about its axis has no
/// effect: in its place the rotation error has the relative error of the gain.
template <typename Scalar>
struct GeneratorField {
    field::Generator<Scalar> generator;
    StaticVector<BodyCoil<Scalar>, 3> coils;

    [[nodiscard]] field::ColumnModel<Scalar> column(const Vec3<Scalar>& position_m, const Mat3<Scalar>& o, int j) const {
        field::ColumnModel<Scalar> result{Vec3<Scalar>::Zero(), Mat3<Scalar>::Zero(), Mat3<Scalar>::Zero()};
        for (int row = 0; row < static_cast<int>(coils.size()); ++row) {
            const auto& [offset_m, axis, gain] = coils[static_cast<std::size_t>(row)];
            const Vec3<Scalar> arm = o.transpose() * offset_m;
            const Vec3<Scalar> n = gain * (o.transpose() * axis);
            const auto x = field::coil_coupling<Scalar>(generator[static_cast<std::size_t>(j)], position_m + arm, n);
            const Vec3<Scalar> by_gain = coils.size() > 1 ? Vec3<Scalar>::Zero() : Vec3<Scalar>(x.value / gain * n);
            result.column(row) = x.value;
            result.by_position_per_m.row(row) = x.by_displacement_per_m.transpose();
            result.by_rotation_per_rad.row(row) =
                (n.cross(x.by_sensitivity) + arm.cross(x.by_displacement_per_m) + by_gain).transpose();
        }
        return result;
    }
};

template <typename Scalar>
struct CoilTrackerParams {
    GeneratorField<Scalar> field;                            // 6 generator coils, or 5 and a known gain, determine a pose
    std::array<Scalar, field::kMaxGeneratorCoils> misfit{};  // of the generator's calibration, relative to the couplings' norm
    Scalar gain_deviation = Scalar(2e-3);                    // standard deviation of a known gain, relative
    Vec3<Scalar> side = Vec3<Scalar>::Zero();                // as in SingleCoilParams
    Microseconds frame{25'000};                              // in which each generator coil is driven once
    Scalar min_snr = 10;                                     // as in CommonParams
    Scalar max_deviation_m = Scalar(0.02);                   // as in CommonParams
    ScaatParams<Scalar> motion;
};

/// Searches until the last columns are those of all generator coils and, as if simultaneous, give a pose; then filters, with a
/// pose for each column. Flags as of the filter in scaat/; ambiguous poses are `hemisphere_unknown`. A pose is also `unconfirmed`
/// if noise and motion do not explain its deviation, until they have done so for two frames. After three refused columns in a
/// row, or a gap of four frames, it searches again.
template <typename Scalar>
class CoilTracker {
public:
    explicit CoilTracker(const CoilTrackerParams<Scalar>& params)
        : params_(params), field_(params.field), adaptation_(params.motion) {}

    /// Empty while it searches in an incomplete frame, and for a column that is late, not finite or of no coil. The rotation
    /// about the axis of a single coil is arbitrary; its variance is that of an unknown angle. The covariance is without the
    /// effect of `misfit`, which stays from frame to frame.
    std::optional<PoseEstimate<Scalar>> update(const GeneratorColumn<Scalar>& column);

    [[nodiscard]] const scaat::Motion<Scalar>& motion() const { return state_; }
    /// Gain of the first coil, and its relative standard deviation (of a single coil).
    [[nodiscard]] Scalar gain() const { return field_.coils[0].gain; }
    [[nodiscard]] Scalar gain_deviation() const { return std::sqrt(gain_variance()); }
    [[nodiscard]] const TrackerCounters& counters() const { return counters_; }

private:
    using Column = GeneratorColumn<Scalar>;
    using Solution = Result<solver::SingleCoilSolution<Scalar>>;

    [[nodiscard]] std::size_t frame() const { return field_.generator.size(); }
    [[nodiscard]] bool is_single() const { return field_.coils.size() == 1; }
    [[nodiscard]] int count_in_frame(std::uint32_t bits) const { return std::popcount(bits & ((1U << frame()) - 1)); }
    [[nodiscard]] Vec3<Scalar> axis() const { return state_.q_source_sensor * field_.coils[0].axis; }
    [[nodiscard]] Scalar gain_variance() const {
        return aligned_.dot(Mat3<Scalar>(state_.covariance.template block<3, 3>(3, 3)) * aligned_);
    }
    void set_gain_variance(Scalar variance) {
        state_.covariance.template block<3, 3>(3, 3) += (variance - gain_variance()) * aligned_ * aligned_.transpose();
    }
    /// Mean square of a coupling, or of its standard deviation, in the last frame.
    [[nodiscard]] Scalar mean_square(Vec3<Scalar> Column::*values) const {
        Scalar sum = 0;
        for (const Column& column : columns_) {
            sum += (column.*values).squaredNorm();
        }
        return sum / Scalar(columns_.size() * field_.coils.size());
    }
    void advance_to(DeviceTime time);
    [[nodiscard]] scaat::Innovation<Scalar> innovation_of(const Column& column) const;
    void update_with(const scaat::Innovation<Scalar>& innovation);
    [[nodiscard]] Solution solve(Scalar motion_share) const;
    void place(const solver::SingleCoilPose<Scalar>& pose);
    [[nodiscard]] PoseFlags start();
    [[nodiscard]] bool use(const Column& column);
    [[nodiscard]] Scalar explained_deviation_m(Scalar snr) const;
    [[nodiscard]] PoseEstimate<Scalar> report(PoseFlags flags, DeviceTime now);

    CoilTrackerParams<Scalar> params_;
    GeneratorField<Scalar> field_;  // with the estimated gain
    scaat::Adaptation<Scalar> adaptation_;
    scaat::State<Scalar> state_;
    Vec3<Scalar> aligned_ = Vec3<Scalar>::Zero();              // axis of a single coil to which the covariance belongs
    StaticVector<Column, field::kMaxGeneratorCoils> columns_;  // the last ones, at most one frame, oldest first
    bool is_running_ = false;
    std::size_t settled_ = 0;     // columns used since the start, at most those of three frames
    std::size_t losses_ = 1;      // one, and recent ones: a wrong generator gives starts that are soon lost
    std::size_t awaited_ = 0;     // acceptances until a pose is confirmed
    std::uint32_t refusals_ = 0;  // one bit for each column, the newest is the lowest
    std::uint32_t large_ = 0;     // the same: innovations that are refused or have less weight
    DeviceTime last_used_{};
    TrackerCounters counters_;
};

}  // namespace tricoil::tracking
