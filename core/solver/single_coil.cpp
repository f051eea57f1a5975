#include "core/solver/single_coil.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/precision.hpp"
#include "core/linear/cholesky.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
constexpr Scalar kHuge = std::numeric_limits<Scalar>::max();

template <typename Scalar>
using PerCoil = std::array<Scalar, field::kMaxGeneratorCoils>;

/// A position, the sensitivity that fits best there, and the normal equations J^T J, J^T r of both.
template <typename Scalar>
struct CoilPoint {
    SingleCoilPose<Scalar> pose;
    Scalar cost = kHuge<Scalar>;
    Scalar nearest_m = 0;                                                 // distance from the nearest source coil
    Mat3<Scalar> by_p = Mat3<Scalar>::Zero(), by_pn = by_p, by_n = by_p;  // by_pn: rows of the position
    Vec3<Scalar> gradient_p = Vec3<Scalar>::Zero(), gradient_n = gradient_p;

    void add(const Vec3<Scalar>& p, const Vec3<Scalar>& n, Scalar residual) {
        cost += residual * residual;
        by_p += p * p.transpose();
        by_pn += p * n.transpose();
        by_n += n * n.transpose();
        gradient_p += residual * p;
        gradient_n += residual * n;
    }
};

template <typename Scalar>
class CoilFit {
public:
    CoilFit(const field::Generator<Scalar>& generator, const CoilCouplings<Scalar>& measured,
            const SingleCoilParams<Scalar>& params)
        : generator_(generator), c_(measured.value), w_(measured.weight), params_(params) {
        if (params.gain > 0) {
            gain_weight_ = 1 / (params.gain * params.gain_deviation);
        }
    }

    Status check() {
        if (c_.size() != generator_.size() || w_.size() != generator_.size()) {
            return {StatusCode::invalid_argument, "couplings and weights must be one for each coil of the generator"};
        }
        if (!(params_.gain >= 0) || !(params_.gain_deviation > 0) || !std::isfinite(params_.gain)) {
            return {StatusCode::invalid_argument, "the gain of the sensor coil must be positive, or zero if it is unknown"};
        }
        equations_ = params_.gain > 0 ? 1 : 0;
        for (std::size_t i = 0; i < c_.size(); ++i) {
            if (!std::isfinite(c_[i]) || !std::isfinite(w_[i]) || w_[i] < 0) {
                return {StatusCode::not_finite, "couplings or weights are NaN, infinite or negative"};
            }
            equations_ += w_[i] > 0 ? 1 : 0;
            signal_ += w_[i] * w_[i] * c_[i] * c_[i];
        }
        if (equations_ < 6) {
            return {StatusCode::invalid_argument,
                    "fewer equations than unknowns: 6 source coils are needed, or 5 and a known gain"};
        }
        if (!(signal_ > std::numeric_limits<Scalar>::min())) {
            return {StatusCode::degenerate, "all couplings are zero: is the sensor coil connected?"};
        }
        return {};
    }

    /// False if the couplings do not determine the sensitivity at a position.
    [[gnu::noinline]] bool evaluate(const Vec3<Scalar>& position_m, CoilPoint<Scalar>& at) const {
        at = {};
        at.pose.position_m = position_m;
        at.nearest_m = kHuge<Scalar>;
        Mat3<Scalar> squares = Mat3<Scalar>::Zero();
        Vec3<Scalar> right = Vec3<Scalar>::Zero();
        for (std::size_t i = 0; i < c_.size(); ++i) {
            at.nearest_m = std::min(at.nearest_m, (position_m - generator_[i].position_m).norm());
            const Vec3<Scalar> b =
                w_[i] * field::coil_coupling<Scalar>(generator_[i], position_m, Vec3<Scalar>::Zero()).by_sensitivity;
            squares += b * b.transpose();
            right += (w_[i] * c_[i]) * b;
        }
        const Scalar mean = squares.trace() / 3;
        if (!(squares.determinant() > Scalar(1e-7) * mean * mean * mean)) {  // above the rounding of float
            return false;
        }
        Vec3<Scalar>& n = at.pose.sensitivity;
        n = squares.inverse() * right;
        const Scalar square = gain_weight_ * gain_weight_;
        for (int pass = 0; pass < (square > 0 ? 3 : 0); ++pass) {  // a known gain is linear only near a direction
            const Vec3<Scalar> axis = n.normalized();
            n = Mat3<Scalar>(squares + square * axis * axis.transpose()).inverse() * (right + square * params_.gain * axis);
        }
        at.cost = 0;
        for (std::size_t i = 0; i < c_.size(); ++i) {
            const auto x = field::coil_coupling<Scalar>(generator_[i], position_m, n);
            at.add(w_[i] * x.by_displacement_per_m, w_[i] * x.by_sensitivity, w_[i] * (x.value - c_[i]));
        }
        if (gain_weight_ > 0) {
            const Scalar length = n.norm();
            at.add(Vec3<Scalar>::Zero(), n * (gain_weight_ / length), gain_weight_ * (length - params_.gain));
        }
        return std::isfinite(at.cost);
    }

    /// Levenberg-Marquardt over the position.
    SingleCoilSolution<Scalar> run(const Vec3<Scalar>& start_m) const {
        SingleCoilSolution<Scalar> result;
        CoilPoint<Scalar> at;
        bool settled = false;
        Scalar damping = 0;
        if (evaluate(start_m, at)) {
            while (!settled && result.iterations < params_.max_iterations) {
                settled = descend(at, damping, result.iterations);
            }
        }
        result.pose = at.pose;
        result.chi_square = at.cost;
        const Scalar misfit = params_.max_misfit_share * params_.max_misfit_share * signal_;
        if (!add_covariance(at, result)) {
            result.end = SingleCoilEnd::undetermined;
        } else if (settled) {
            result.end = at.cost <= gate() + misfit ? SingleCoilEnd::converged : SingleCoilEnd::wrong_minimum;
        }
        return result;
    }

    /// Signal to noise of 50 dB: noise does not make another minimum as good as the best one.
    [[nodiscard]] bool is_clear() const { return signal_ > Scalar(1e5) * Scalar(equations_); }
    /// Chi-square that noise exceeds once in 100,000 poses, by Wilson and Hilferty.
    [[nodiscard]] Scalar gate() const {
        const Scalar freedom = Scalar(std::max(equations_ - 6, 1));
        const Scalar spread = Scalar(2) / (9 * freedom);
        const Scalar root = 1 - spread + Scalar(4.26) * std::sqrt(spread);
        return freedom * root * root * root;
    }

private:
    /// Tries steps with growing damping until one does not increase the cost. True if the step was small.
    bool descend(CoilPoint<Scalar>& at, Scalar& damping, int& iterations) const {
        const Mat3<Scalar> eliminated = at.by_pn * at.by_n.inverse();
        const Mat3<Scalar> information = at.by_p - eliminated * at.by_pn.transpose();
        const Vec3<Scalar> gradient = at.gradient_p - eliminated * at.gradient_n;
        while (iterations < params_.max_iterations) {
            ++iterations;
            Mat3<Scalar> damped = information;
            damped.diagonal() *= 1 + damping;
            Vec3<Scalar> step = damped.inverse() * -gradient;
            step /= std::max(Scalar(1), step.norm() / (params_.max_step * at.nearest_m));
            CoilPoint<Scalar> trial;
            const bool tiny = step.norm() < params_.step_tolerance * at.nearest_m;
            if (step.allFinite() && evaluate(at.pose.position_m + step, trial) && (tiny || trial.cost <= at.cost)) {
                at = trial;
                const bool settled = tiny && damping < Scalar(1e-2);
                damping = damping > Scalar(1e-4) ? damping / 10 : Scalar(0);
                return settled;
            }
            damping = std::max(damping * 8, Scalar(1e-2));
        }
        return false;
    }

    /// False if the couplings do not determine position and axis.
    [[gnu::noinline]] bool add_covariance(const CoilPoint<Scalar>& at, SingleCoilSolution<Scalar>& result) const {
        const Scalar gain = at.pose.sensitivity.norm();
        Vec6<Scalar> units = Vec6<Scalar>::Constant(gain);  // in which all unknowns are of one size
        units.template head<3>().setConstant(at.nearest_m);
        Mat6<Scalar> information;
        information.template topLeftCorner<3, 3>() = at.by_p;
        information.template topRightCorner<3, 3>() = at.by_pn;
        information.template bottomLeftCorner<3, 3>() = at.by_pn.transpose();
        information.template bottomRightCorner<3, 3>() = at.by_n;
        const Cholesky<Scalar, 6> cholesky(units.asDiagonal() * information * units.asDiagonal());
        if (!cholesky.ok()) {
            return false;
        }
        const Mat6<Scalar> inverse = cholesky.template solve<6>(Mat6<Scalar>::Identity());
        const Vec3<Scalar> axis = at.pose.sensitivity / gain;
        result.gain_deviation = std::sqrt(axis.dot(Mat3<Scalar>(inverse.template bottomRightCorner<3, 3>()) * axis));
        Mat6<Scalar> across = Mat6<Scalar>::Identity();
        across.template bottomRightCorner<3, 3>() -= axis * axis.transpose();
        result.covariance = across * inverse * across.transpose();
        const Vec6<Scalar> variance = result.covariance.diagonal();
        units.template tail<3>().setConstant(1);
        result.covariance = units.asDiagonal() * result.covariance * units.asDiagonal();
        const Scalar limit = params_.max_deviation_share * params_.max_deviation_share;
        return variance.template head<3>().sum() < limit && variance.template tail<3>().sum() < limit;
    }

    const field::Generator<Scalar>& generator_;
    std::span<const Scalar> c_;
    std::span<const Scalar> w_;
    const SingleCoilParams<Scalar>& params_;
    Scalar gain_weight_ = 0;  // zero: the gain is unknown
    Scalar signal_ = 0;       // squared norm of the weighted couplings
    int equations_ = 0;
};

/// Weights of a search. Near a source coil its coupling is far above the others and, with weights of noise, makes the region from
/// which steps lead to the minimum small: here each coupling also has a relative error.
template <typename Scalar>
PerCoil<Scalar> search_weights(const CoilCouplings<Scalar>& measured) {
    const auto [couplings, weights] = measured;
    Scalar squares = 0;
    for (const Scalar c : couplings) {
        squares += c * c;
    }
    PerCoil<Scalar> result{};
    for (std::size_t i = 0; i < couplings.size(); ++i) {
        const Scalar beyond = (Scalar(0.01) * couplings[i] * couplings[i] + Scalar(1e-4) * squares) * weights[i] * weights[i];
        result[i] = weights[i] / std::sqrt(1 + beyond);
    }
    return result;
}

template <typename Scalar>
struct CoilStart {
    Scalar cost = kHuge<Scalar>;
    Vec3<Scalar> position_m;
};

constexpr int kCoilStarts = 64;  // that may be refined
constexpr int kClearStarts = 8;  // that are refined if one converges and noise is low

/// The best starts in 26 directions (faces, edges and corners of a cube) at several distances from the middle of the coils, in
/// order.
template <typename Scalar>
[[gnu::noinline]] std::array<CoilStart<Scalar>, kCoilStarts> starts_of(const CoilFit<Scalar>& fit,
                                                                       const field::Generator<Scalar>& generator,
                                                                       const Vec3<Scalar>& centre, const Vec3<Scalar>& side) {
    Scalar radius = 0;
    for (const auto& coil : generator) {
        radius = std::max(radius, (coil.position_m - centre).norm());
    }
    std::array<CoilStart<Scalar>, kCoilStarts> best;
    for (int cell = 0; cell < 27; ++cell) {
        const Vec3<Scalar> u = Vec3<Scalar>(Scalar(cell % 3 - 1), Scalar(cell / 3 % 3 - 1), Scalar(cell / 9 - 1)).normalized();
        if (cell == 13 || (!side.isZero(0) && !(u.dot(side) > 0))) {
            continue;
        }
        for (const double distance : {0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0, 5.5}) {
            CoilPoint<Scalar> at;
            if (fit.evaluate(centre + (Scalar(distance) * radius) * u, at)) {
                const CoilStart<Scalar> start{at.cost, at.pose.position_m};
                const auto place = std::upper_bound(best.begin(), best.end(), start,
                                                    [](const auto& a, const auto& b) { return a.cost < b.cost; });
                if (place != best.end()) {
                    std::move_backward(place, best.end() - 1, best.end());
                    *place = start;
                }
            }
        }
    }
    return best;
}

}  // namespace

template <typename Scalar>
Result<SingleCoilSolution<Scalar>> solve_single_coil(const field::Generator<Scalar>& generator,
                                                     const CoilCouplings<Scalar>& measured,
                                                     const SingleCoilParams<Scalar>& params) {
    CoilFit<Scalar> fit(generator, measured, params);
    const Status status = fit.check();
    if (!status.ok()) {
        return status;
    }
    if (params.start_m) {
        return fit.run(*params.start_m);
    }
    Vec3<Scalar> centre = Vec3<Scalar>::Zero();
    for (const auto& coil : generator) {
        centre += coil.position_m / Scalar(generator.size());
    }
    const PerCoil<Scalar> soft = search_weights(measured);
    const CoilFit<Scalar> coarse(generator, {measured.value, {soft.data(), measured.weight.size()}}, params);
    SingleCoilSolution<Scalar> best;
    best.chi_square = kHuge<Scalar>;
    best.end = SingleCoilEnd::undetermined;
    Scalar second = kHuge<Scalar>;  // least cost of another minimum
    int left = fit.is_clear() ? kClearStarts : kCoilStarts;
    int iterations = 0;
    for (const CoilStart<Scalar>& start : starts_of(coarse, generator, centre, params.side)) {
        if (start.cost == kHuge<Scalar> || (--left < 0 && best.converged())) {
            break;
        }
        const auto near = coarse.run(start.position_m);
        auto next = fit.run(near.pose.position_m);
        iterations += near.iterations + next.iterations;
        const Vec3<Scalar> from_centre = next.pose.position_m - centre;
        if (!params.side.isZero(0) && !(from_centre.dot(params.side) > 0)) {
            continue;
        }
        const Scalar apart = (next.pose.position_m - best.pose.position_m).norm();
        if (next.chi_square < best.chi_square) {
            std::swap(next, best);
        }
        if (!(apart < Scalar(0.02) * from_centre.norm()) && next.end != SingleCoilEnd::not_converged) {
            second = std::min(second, next.chi_square);
        }
    }
    best.iterations = iterations;
    // Difference of two costs that noise, or a misfit of the size of the best one, may cause.
    const Scalar margin = 20 * std::max(Scalar(1), best.chi_square / fit.gate());
    if (best.converged() && second - best.chi_square < margin) {
        best.end = SingleCoilEnd::ambiguous;
    }
    return best;
}

#if TRICOIL_SCALARS & 1  // float
template Result<SingleCoilSolution<float>> solve_single_coil(const field::Generator<float>&, const CoilCouplings<float>&,
                                                             const SingleCoilParams<float>&);
#endif
#if TRICOIL_SCALARS & 2  // double
template Result<SingleCoilSolution<double>> solve_single_coil(const field::Generator<double>&, const CoilCouplings<double>&,
                                                              const SingleCoilParams<double>&);
#endif

}  // namespace tricoil::solver
