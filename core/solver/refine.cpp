#include "core/solver/refine.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/rotations.hpp"
#include "core/geometry/solve_columns.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
using Vec9 = Eigen::Matrix<Scalar, 9, 1>;

/// The model at a pose against the couplings, weighted; columns of the Jacobian in units of range and rad.
template <typename Scalar>
struct Linearised {
    Eigen::Matrix<Scalar, 9, 6> jacobian;
    Vec9<Scalar> residual;
    Scalar cost = 0;
    Scalar range_m = 1;

    /// J^T J, entry by entry: nine rows are enough for Eigen to choose its product for large matrices, which names malloc.
    [[nodiscard]] Mat6<Scalar> information() const { return jacobian.transpose().lazyProduct(jacobian); }
};

template <typename Scalar>
Linearised<Scalar> linearise(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                             const RigidPose<Scalar>& pose) {
    const Mat3<Scalar> o = pose.q_source_sensor.toRotationMatrix().transpose();
    const auto at = field::signal_model<Scalar>(model, pose.position_m, o);
    const Vec9<Scalar> w = weights.reshaped();
    Linearised<Scalar> result;
    result.range_m = pose.position_m.norm();
    result.residual = w.cwiseProduct((at.x - x).reshaped());
    result.jacobian = w.asDiagonal() * at.jacobian;
    result.jacobian.template leftCols<3>() *= result.range_m;
    result.cost = result.residual.squaredNorm();
    return result;
}

template <typename Scalar>
RigidPose<Scalar> moved(const RigidPose<Scalar>& pose, const Vec6<Scalar>& step, Scalar range_m) {
    const Vec3<Scalar> rotation = step.template tail<3>();
    return {pose.position_m + range_m * step.template head<3>(),
            (geometry::rotation_vector_to_quaternion<Scalar>(rotation) * pose.q_source_sensor).normalized()};
}

/// Shortens a step whose length leaves the region where the linear model means something.
template <typename Scalar>
Vec6<Scalar> limited(const Vec6<Scalar>& step, const RefineParams<Scalar>& params) {
    const Scalar by_position = step.template head<3>().norm() / params.max_range_step;
    const Scalar by_rotation = step.template tail<3>().norm() / params.max_rotation_step;
    return step / std::max({Scalar(1), by_position, by_rotation});
}

template <typename Scalar>
Status check(const Mat3<Scalar>& x, const Mat3<Scalar>& weights, const RigidPose<Scalar>& start) {
    if (!x.allFinite() || !weights.allFinite() || !start.position_m.allFinite() || !start.q_source_sensor.coeffs().allFinite()) {
        return {StatusCode::not_finite, "couplings, weights or start hold NaN or infinity"};
    }
    if (!(x.cwiseProduct(weights).cwiseAbs().maxCoeff() > std::numeric_limits<Scalar>::min()) ||
        !(start.position_m.squaredNorm() > std::numeric_limits<Scalar>::min())) {
        return {StatusCode::degenerate, "couplings or weights are zero, or the start lies in the source's origin"};
    }
    return {};
}

/// One run; the state of the iteration between steps.
template <typename Scalar>
class Iteration {
public:
    Iteration(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
              const RigidPose<Scalar>& start, const RefineParams<Scalar>& params)
        : model_(model), x_(x), weights_(weights), params_(params), signal_(x.cwiseProduct(weights).squaredNorm()) {
        result_.pose = start;
        at_ = linearise(model_, x_, weights_, start);
        result_.iterations = 0;
    }

    Refinement<Scalar> run() {
        while (result_.iterations < params_.max_iterations) {
            const Mat6<Scalar> information = at_.information();
            const Vec6<Scalar> gradient = at_.jacobian.transpose() * at_.residual;
            if (!descend(information, gradient)) {
                result_.end = RefineEnd::singular;
                return finish();
            }
            if (small_step_) {
                result_.end = explained() ? RefineEnd::converged : RefineEnd::wrong_minimum;
                return finish();
            }
        }
        return finish();
    }

private:
    /// Tries steps with growing damping until one does not raise the cost. False if the normal matrix is not definite.
    bool descend(const Mat6<Scalar>& information, const Vec6<Scalar>& gradient) {
        while (result_.iterations < params_.max_iterations) {
            ++result_.iterations;
            Mat6<Scalar> damped = information;
            damped.diagonal() *= 1 + damping_;
            const Eigen::LLT<Mat6<Scalar>> cholesky(damped);
            if (cholesky.info() != Eigen::Success) {
                return false;
            }
            const Vec6<Scalar> full = -cholesky.solve(gradient);
            const Vec6<Scalar> step = limited(full, params_);
            const RigidPose<Scalar> trial = moved(result_.pose, step, at_.range_m);
            const auto there = linearise(model_, x_, weights_, trial);
            const bool tiny = step.cwiseAbs().maxCoeff() < params_.step_tolerance;
            // A tiny step may raise the cost by rounding alone.
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

    [[nodiscard]] bool explained() const {
        return at_.cost <= params_.noise_gate + params_.max_misfit_share * params_.max_misfit_share * signal_;
    }

    Refinement<Scalar> finish() {
        const Mat6<Scalar> information = at_.information();
        const Eigen::LLT<Mat6<Scalar>> cholesky(information);
        const Scalar reciprocal = cholesky.info() == Eigen::Success ? cholesky.rcond() : Scalar(0);
        result_.condition = reciprocal > 0 ? 1 / reciprocal : std::numeric_limits<Scalar>::max();
        if (result_.condition > params_.max_condition && result_.end == RefineEnd::converged) {
            result_.end = RefineEnd::singular;
        }
        if (reciprocal > 0) {
            Vec6<Scalar> units = Vec6<Scalar>::Ones();
            units.template head<3>().setConstant(at_.range_m);
            result_.covariance = units.asDiagonal() * solve_columns(cholesky, Mat6<Scalar>::Identity()) * units.asDiagonal();
        }
        result_.misfit_squared = at_.cost;
        result_.misfit_share = std::sqrt(at_.cost / signal_);
        return result_;
    }

    const field::GeneralDipole<Scalar>& model_;
    const Mat3<Scalar>& x_;
    const Mat3<Scalar>& weights_;
    const RefineParams<Scalar>& params_;
    Scalar signal_;
    Scalar damping_ = 0;
    bool small_step_ = false;
    Linearised<Scalar> at_;
    Refinement<Scalar> result_;
};

}  // namespace

template <typename Scalar>
Result<Refinement<Scalar>> refine(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                  const RigidPose<Scalar>& start, const RefineParams<Scalar>& params) {
    const Status status = check(x, weights, start);
    if (!status.ok()) {
        return status;
    }
    return Iteration<Scalar>(model, x, weights, start, params).run();
}

template Result<Refinement<float>> refine(const field::GeneralDipole<float>&, const Mat3<float>&, const Mat3<float>&,
                                          const RigidPose<float>&, const RefineParams<float>&);
template Result<Refinement<double>> refine(const field::GeneralDipole<double>&, const Mat3<double>&, const Mat3<double>&,
                                           const RigidPose<double>&, const RefineParams<double>&);

}  // namespace tricoil::solver
