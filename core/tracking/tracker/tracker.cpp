#include "core/tracking/tracker/tracker.hpp"

#include <algorithm>
#include <type_traits>

#include "core/base/precision.hpp"
#include "core/geometry/quaternion_sign.hpp"
#include "core/tracking/hemisphere.hpp"
#include "core/tracking/judge/coil_errors.hpp"
#include "core/tracking/judge/converter_share.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::tracking {

template <typename Scalar>
CommonParams<Scalar> Tracker<Scalar>::corrected(CommonParams<Scalar> params, const Correction& correction) {
    if (!correction) {
        return params;
    }
    params.misfit_floor = std::max(params.misfit_floor, correction->misfit_floor());
    params.floor_share = correction->errors().floor_share;
    params.quadrature_floor = correction->quadrature_floor();
    params.pick_up_sigma = std::max(params.pick_up_sigma, correction->pick_up_sigma());
    if (correction->has_own_axes()) {
        params.coupling_constant = 1;
        params.hemisphere = correction->axes().transpose() * params.hemisphere;
    }
    return params;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::update(const Column<Scalar>& column) {
    if (column.flags.has(ColumnFlag::low_band)) {
        update_low(column);
        return std::nullopt;
    }
    return update_high(column);
}

/// Not part of update(): their temporaries would add up on the stack.
template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::update_high(const Column<Scalar>& column) {
    Column<Scalar> corrected = column;
    const int coil = coil_index(column.state);
    if (correction_ && coil >= 0) {
        correction_->correct_column(coil, corrected.in_phase, corrected.quadrature, corrected.sigma);
    }
    const std::uint64_t used = used_columns();
    const std::uint64_t known = counters_.rejected[static_cast<std::size_t>(Rejection::duplicate)];
    std::optional<PoseEstimate<Scalar>> estimate = track(corrected);
    if (used_columns() > used) {
        since_gap_.add(1, column.flags.has(ColumnFlag::after_gap));
    } else if (counters_.rejected[static_cast<std::size_t>(Rejection::duplicate)] == known) {
        since_gap_.refuse();
    }
    finish(estimate);
    return estimate;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::track(const Column<Scalar>& corrected) {
    const Admission admission = admit(corrected, time_base_);
    if (admission.has_restarted) {
        ++counters_.clock_restarts;
        state_.restart(corrected.midpoint);
        do_restart(corrected.midpoint);
    }
    if (admission.rejection) {
        ++counters_.rejected[static_cast<std::size_t>(*admission.rejection)];
        return std::nullopt;
    }
    ++counters_.accepted;
    return do_update(corrected, admission.is_late);
}

/// Coils in float have no calibration of a low band.
template <typename Scalar>
void Tracker<Scalar>::update_low([[maybe_unused]] const Column<Scalar>& column) {
    if constexpr (std::is_same_v<Scalar, double>) {
        Column<Scalar> corrected = column;
        const int coil = coil_index(column.state);
        if (correction_ && coil >= 0) {
            correction_->correct_low_column(coil, corrected.in_phase, corrected.quadrature, corrected.sigma);
        }
        do_update_low(corrected);
    }
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::tick(DeviceTime now) {
    const bool is_time = now <= TimeBase::kLatest && now >= TimeBase::kEarliest;
    std::optional<PoseEstimate<Scalar>> estimate = is_time ? do_tick(now) : std::nullopt;
    finish(estimate);
    return estimate;
}

template <typename Scalar>
Status Tracker<Scalar>::set_hemisphere(const Vec3<Scalar>& towards) {
    if (!is_hemisphere(towards)) {
        return {StatusCode::not_finite, "hemisphere must be a finite direction, or zero for unknown"};
    }
    do_set_hemisphere(correction_ && correction_->has_own_axes() ? Vec3<Scalar>(correction_->axes().transpose() * towards)
                                                                 : towards);
    return {};
}

template <typename Scalar>
void Tracker<Scalar>::count(PoseEstimate<Scalar>& estimate, DeviceTime measured, DeviceTime now) {
    if (estimate.valid()) {
        counters_.acquisitions += state_.found(measured, params_) ? 1U : 0U;
    } else {
        ++counters_.invalid_poses;
        state_.missed(now, params_);
    }
    estimate.state = state_.state();
    estimate.sequence = static_cast<std::uint32_t>(counters_.poses++);
}

template <typename Scalar>
void Tracker<Scalar>::finish(std::optional<PoseEstimate<Scalar>>& estimate) {
    if (!estimate) {
        return;
    }
    estimate->flags.set_if(since_gap_.is_recent(), PoseFlag::columns_missing);
    to_source_frame(*estimate);
    cover_constant_errors(*estimate);
    clear_unknown_position(*estimate);
    Quat<Scalar>& q = estimate->q_source_sensor;
    q = geometry::with_sign_of(q, last_reported_);
    last_reported_ = q;
}

/// After the method: these errors are constant, so that no filter reduces them, and no misfit shows them. The tracker stays in
/// its state even if they alone make the pose uncertain.
template <typename Scalar>
[[gnu::noinline]] void Tracker<Scalar>::cover_constant_errors(PoseEstimate<Scalar>& estimate) const {
    auto errors = correction_ ? correction_->errors() : calibration::CoilErrors<Scalar>{};
    add_converter_error(estimate.signal_matrix, errors);
    if (!errors.is_none()) {
        const Mat6<Scalar> covariance = covariance_of_coil_errors(errors, estimate.position_m);
        const Scalar limit_m = params_.max_deviation_m;
        estimate.covariance += covariance;
        estimate.flags.set_if(covariance.template topLeftCorner<3, 3>().trace() > limit_m * limit_m, PoseFlag::uncertain);
    }
}

/// Trackers in float, of images, do not know their converters.
template <typename Scalar>
void Tracker<Scalar>::add_converter_error([[maybe_unused]] const Mat3<Scalar>& x,
                                          [[maybe_unused]] calibration::CoilErrors<Scalar>& errors) const {
    if constexpr (std::is_same_v<Scalar, double>) {
        if (params_.converter.coupling > 0) {
            Mat3<Scalar> steps;
            for (int j = 0; j < kSourceCoils; ++j) {
                Vec3<Scalar> step = Vec3<Scalar>::Constant(params_.converter.coupling);
                if (correction_) {
                    correction_->correct_sigma(j, step);
                }
                steps.col(j) = step;
            }
            errors.couplings = std::hypot(errors.couplings, converter_share(x, steps, params_.converter.noise));
        }
    }
}

/// Not inlined, so that its temporaries do not add to the stack of the method.
template <typename Scalar>
[[gnu::noinline]] void Tracker<Scalar>::to_source_frame(PoseEstimate<Scalar>& estimate) const {
    if (!correction_) {
        return;
    }
    if (correction_->has_own_axes()) {
        OutputFrame<Scalar> frame;
        frame.q_source_alignment = Quat<Scalar>(correction_->axes()).conjugate().normalized();
        estimate = in_frame(estimate, frame);
    }
    if (correction_->corrects_output()) {
        estimate.position_m = correction_->corrected_position(estimate.position_m);
        Mat6<Scalar> jacobian = Mat6<Scalar>::Identity();
        jacobian.template topLeftCorner<3, 3>() = correction_->output_linear();
        estimate.covariance = jacobian * estimate.covariance * jacobian.transpose();
    }
}

template class Tracker<float>;
#if TRICOIL_SCALARS & 2  // double
template class Tracker<double>;
#endif

}  // namespace tricoil::tracking
