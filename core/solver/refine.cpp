#include "core/solver/refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/precision.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/cholesky.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
using Vec9 = Matrix<Scalar, 9, 1>;

/// Normal equations at a pose, J^T J and J^T r of the weighted residuals; lengths in units of range, angles in rad.
template <typename Scalar>
struct NormalEquations {
    Mat6<Scalar> information;
    Vec6<Scalar> gradient;
    Scalar cost = 0;
    Scalar range_m = 1;
};

/// Not inlined, so that the Jacobian is off the stack while a step is tried.
template <typename Scalar>
[[gnu::noinline]] void linearise(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                 const RigidPose<Scalar>& pose, NormalEquations<Scalar>& result) {
    auto at = field::signal_model<Scalar>(model, pose.position_m, pose.q_source_sensor.toRotationMatrix().transpose());
    result.range_m = pose.position_m.norm();
    const Vec9<Scalar> residual = weights.reshaped().cwiseProduct((at.x - x).reshaped());
    for (Index i = 0; i < 9; ++i) {
        at.jacobian.row(i) *= weights(i);
    }
    at.jacobian.template leftCols<3>() *= result.range_m;
    result.cost = residual.squaredNorm();
    result.information = at.jacobian.transpose() * at.jacobian;
    result.gradient = at.jacobian.transpose() * residual;
}

template <typename Scalar>
RigidPose<Scalar> moved(const RigidPose<Scalar>& pose, const Vec6<Scalar>& step, Scalar range_m) {
    const Vec3<Scalar> rotation = step.template tail<3>();
    return {pose.position_m + range_m * step.template head<3>(),
            (geometry::rotation_vector_to_quaternion<Scalar>(rotation) * pose.q_source_sensor).normalized()};
}

/// Shortens a step to the region in which the linear model is valid.
template <typename Scalar>
Vec6<Scalar> limited(const Vec6<Scalar>& step, const RefineParams<Scalar>& params) {
    const Scalar by_position = step.template head<3>().norm() / params.max_range_step;
    const Scalar by_rotation = step.template tail<3>().norm() / params.max_rotation_step;
    return step / std::max({Scalar(1), by_position, by_rotation});
}

template <typename Scalar>
Status check(const Mat3<Scalar>& x, const Mat3<Scalar>& weights, const RigidPose<Scalar>& start) {
    if (!x.allFinite() || !weights.allFinite() || !start.position_m.allFinite() || !start.q_source_sensor.coeffs().allFinite()) {
        return {StatusCode::not_finite, "couplings, weights or start contain NaN or infinity"};
    }
    if (!(x.cwiseProduct(weights).cwiseAbs().maxCoeff() > std::numeric_limits<Scalar>::min()) ||
        !(start.position_m.squaredNorm() > std::numeric_limits<Scalar>::min())) {
        return {StatusCode::degenerate, "couplings or weights are zero, or the start pose is at the origin of the source frame"};
    }
    return {};
}

/// One run of the iteration, with its state between steps.
template <typename Scalar>
class Iteration {
public:
    Iteration(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
              const RigidPose<Scalar>& start, const RefineParams<Scalar>& params)
        : model_(model), x_(x), weights_(weights), params_(params), signal_(x.cwiseProduct(weights).squaredNorm()) {
        result_.pose = start;
        linearise(model_, x_, weights_, start, at_);
    }

    Minimum<Scalar> run() {
        result_.end = end_of_steps();
        result_.misfit_squared = at_.cost;
        result_.misfit_share = std::sqrt(at_.cost / signal_);
        const Scalar reciprocal = reciprocal_condition(at_.information);
        result_.condition = reciprocal > 0 ? 1 / reciprocal : std::numeric_limits<Scalar>::max();
        if (result_.condition > params_.max_condition && result_.end == RefineEnd::converged) {
            result_.end = RefineEnd::singular;
        }
        return result_;
    }

    /// After run(): (position, small rotation), source frame; zero if the couplings do not determine the pose.
    [[nodiscard]] Mat6<Scalar> covariance() const {
        const Cholesky<Scalar, 6> cholesky(at_.information);
        if (!cholesky.ok()) {
            return Mat6<Scalar>::Zero();
        }
        Vec6<Scalar> units = Vec6<Scalar>::Ones();
        units.template head<3>().setConstant(at_.range_m);
        return units.asDiagonal() * cholesky.template solve<6>(Mat6<Scalar>::Identity()) * units.asDiagonal();
    }

private:
    RefineEnd end_of_steps() {
        while (result_.iterations < params_.max_iterations) {
            if (!descend()) {
                return RefineEnd::singular;
            }
            if (small_step_) {
                return explained() ? RefineEnd::converged : RefineEnd::wrong_minimum;
            }
        }
        return RefineEnd::iteration_limit;
    }

    /// Tries steps with growing damping until one does not increase the cost. False if the normal matrix is not definite.
    bool descend() {
        while (result_.iterations < params_.max_iterations) {
            ++result_.iterations;
            Vec6<Scalar> step;
            if (!damped_step(at_, damping_, step)) {
                return false;
            }
            step = limited(step, params_);
            const RigidPose<Scalar> trial = moved(result_.pose, step, at_.range_m);
            NormalEquations<Scalar> there;
            linearise(model_, x_, weights_, trial, there);
            const bool tiny = step.cwiseAbs().maxCoeff() < params_.step_tolerance;
            // Rounding may increase the cost after a tiny step.
            if (std::isfinite(there.cost) && (tiny || there.cost <= at_.cost)) {
                result_.pose = trial;
                at_ = there;
                small_step_ = tiny && damping_ < Scalar(1e-2);
                damping_ = damping_ > Scalar(1e-4) ? damping_ / 10 : Scalar(0);
                return true;
            }
            damping_ = std::max(damping_ * 8, Scalar(1e-2));
        }
        return true;
    }

    /// Not inlined, so that its factors are off the stack at the next linearisation. False if the normal matrix is not definite.
    [[gnu::noinline]] static bool damped_step(const NormalEquations<Scalar>& at, Scalar damping, Vec6<Scalar>& step) {
        Mat6<Scalar> damped = at.information;
        damped.diagonal() *= 1 + damping;
        const Cholesky<Scalar, 6> cholesky(damped);
        if (cholesky.ok()) {
            step = -cholesky.solve(at.gradient);
        }
        return cholesky.ok();
    }

    /// Zero if the matrix is not definite. Not inlined, for the same reason.
    [[gnu::noinline]] static Scalar reciprocal_condition(const Mat6<Scalar>& information) {
        const Cholesky<Scalar, 6> cholesky(information);
        if (!cholesky.ok()) {
            return Scalar(0);
        }
        const Mat6<Scalar> inverse = cholesky.template solve<6>(Mat6<Scalar>::Identity());
        const auto norm = [](const Mat6<Scalar>& m) { return m.cwiseAbs().colwise().sum().maxCoeff(); };
        return 1 / (norm(information) * norm(inverse));
    }

    [[nodiscard]] bool explained() const {
        return at_.cost <= params_.noise_gate + params_.max_misfit_share * params_.max_misfit_share * signal_;
    }

    const field::GeneralDipole<Scalar>& model_;
    const Mat3<Scalar>& x_;
    const Mat3<Scalar>& weights_;
    const RefineParams<Scalar>& params_;
    Scalar signal_;
    Scalar damping_ = 0;
    bool small_step_ = false;
    NormalEquations<Scalar> at_;
    Minimum<Scalar> result_;
};

}  // namespace

template <typename Scalar>
Result<Refinement<Scalar>> refine(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                  const RigidPose<Scalar>& start, const RefineParams<Scalar>& params) {
    const Status status = check(x, weights, start);
    if (!status.ok()) {
        return status;
    }
    Iteration<Scalar> iteration(model, x, weights, start, params);
    const Minimum<Scalar> minimum = iteration.run();
    return Refinement<Scalar>{minimum, iteration.covariance()};
}

template <typename Scalar>
Result<Minimum<Scalar>> minimise(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                 const RigidPose<Scalar>& start, const RefineParams<Scalar>& params) {
    const Status status = check(x, weights, start);
    if (!status.ok()) {
        return status;
    }
    return Iteration<Scalar>(model, x, weights, start, params).run();
}

#if TRICOIL_SCALARS & 1  // float
template Result<Refinement<float>> refine(const field::GeneralDipole<float>&, const Mat3<float>&, const Mat3<float>&,
                                          const RigidPose<float>&, const RefineParams<float>&);
template Result<Minimum<float>> minimise(const field::GeneralDipole<float>&, const Mat3<float>&, const Mat3<float>&,
                                         const RigidPose<float>&, const RefineParams<float>&);
#endif
#if TRICOIL_SCALARS & 2  // double
template Result<Refinement<double>> refine(const field::GeneralDipole<double>&, const Mat3<double>&, const Mat3<double>&,
                                           const RigidPose<double>&, const RefineParams<double>&);
template Result<Minimum<double>> minimise(const field::GeneralDipole<double>&, const Mat3<double>&, const Mat3<double>&,
                                          const RigidPose<double>&, const RefineParams<double>&);
#endif

}  // namespace tricoil::solver
