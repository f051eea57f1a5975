#include "core/solver/single_coil.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/precision.hpp"
#include "core/linear/cholesky.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
constexpr Scalar kNever = std::numeric_limits<Scalar>::max();

/// Normal equations of (position, sensitivity) at a position with its best sensitivity.
template <typename Scalar>
struct Point {
    Vec3<Scalar> position_m;
    Vec3<Scalar> sensitivity;
    Scalar cost = kNever<Scalar>;
    Scalar nearest_m = 0;            // distance from the nearest source coil
    Mat3<Scalar> by_n, by_pn, by_p;  // blocks of J^T J; by_pn: rows of the position
    Vec3<Scalar> gradient_n, gradient_p;
};

template <typename Scalar>
Vec3<Scalar> centre_of(const field::Generator<Scalar>& generator) {
    Vec3<Scalar> sum = Vec3<Scalar>::Zero();
    for (const auto& coil : generator) {
        sum += coil.position_m;
    }
    return sum / Scalar(generator.size());
}

/// Chi-square that noise exceeds once in 100,000 poses, by Wilson and Hilferty.
template <typename Scalar>
Scalar noise_gate(Scalar freedom) {
    const Scalar spread = Scalar(2) / (9 * std::max(freedom, Scalar(1)));
    const Scalar root = 1 - spread + Scalar(4.26) * std::sqrt(spread);
    return std::max(freedom, Scalar(1)) * root * root * root;
}

template <typename Scalar>
class Fit {
public:
    Fit(const field::Generator<Scalar>& generator, std::span<const Scalar> couplings, std::span<const Scalar> weights,
        const SingleCoilParams<Scalar>& params)
        : generator_(generator), c_(couplings), w_(weights), params_(params) {
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
        for (std::size_t i = 0; i < c_.size(); ++i) {
            if (!std::isfinite(c_[i]) || !std::isfinite(w_[i]) || w_[i] < 0) {
                return {StatusCode::not_finite, "couplings or weights are NaN, infinite or negative"};
            }
            used_ += w_[i] > 0 ? 1 : 0;
            signal_ += w_[i] * w_[i] * c_[i] * c_[i];
        }
        if (used_ + (params_.gain > 0 ? 1 : 0) < 6) {
            return {StatusCode::invalid_argument,
                    "fewer equations than unknowns: 6 source coils are needed, or 5 and a known gain"};
        }
        if (!(signal_ > std::numeric_limits<Scalar>::min())) {
            return {StatusCode::degenerate, "all couplings are zero: is the sensor coil connected?"};
        }
        return {};
    }

    /// Fits the sensitivity at a position. False if the couplings do not determine it there.
    bool project(const Vec3<Scalar>& position_m, Point<Scalar>& at) const {
        at.position_m = position_m;
        at.by_n.setZero();
        Vec3<Scalar> right = Vec3<Scalar>::Zero();
        Scalar nearest_squared = kNever<Scalar>;
        std::array<Vec3<Scalar>, field::kMaxGeneratorCoils> b;
        for (std::size_t i = 0; i < c_.size(); ++i) {
            nearest_squared = std::min(nearest_squared, (position_m - generator_[i].position_m).squaredNorm());
            b[i] = w_[i] * field::coil_coupling<Scalar>(generator_[i], position_m, Vec3<Scalar>::Zero()).by_sensitivity;
            at.by_n += b[i] * b[i].transpose();
            right += (w_[i] * c_[i]) * b[i];
        }
        at.nearest_m = std::sqrt(nearest_squared);
        const Scalar mean = at.by_n.trace() / 3;
        // Not determined; the limit is above the rounding of float.
        if (!(at.by_n.determinant() > Scalar(1e-7) * mean * mean * mean)) {
            at.cost = kNever<Scalar>;
            return false;
        }
        at.sensitivity = at.by_n.inverse() * right;
        const Scalar square = gain_weight_ * gain_weight_;
        for (int pass = 0; pass < (square > 0 ? 3 : 0); ++pass) {  // a known gain is linear only near a direction
            const Vec3<Scalar> axis = at.sensitivity.normalized();
            at.sensitivity =
                Mat3<Scalar>(at.by_n + square * axis * axis.transpose()).inverse() * (right + square * params_.gain * axis);
        }
        const Scalar beyond = gain_weight_ * (at.sensitivity.norm() - params_.gain);
        at.cost = gain_weight_ > 0 ? beyond * beyond : Scalar(0);
        for (std::size_t i = 0; i < c_.size(); ++i) {
            const Scalar residual = b[i].dot(at.sensitivity) - w_[i] * c_[i];
            at.cost += residual * residual;
        }
        return std::isfinite(at.cost);
    }

    /// Completes the normal equations of a projected point.
    [[gnu::noinline]] void linearise(Point<Scalar>& at) const {
        at.by_p.setZero();
        at.by_pn.setZero();
        at.by_n.setZero();
        at.gradient_p.setZero();
        at.gradient_n.setZero();
        for (std::size_t i = 0; i < c_.size(); ++i) {
            const auto x = field::coil_coupling<Scalar>(generator_[i], at.position_m, at.sensitivity);
            const Vec3<Scalar> by_p = w_[i] * x.by_displacement_per_m;
            const Vec3<Scalar> by_n = w_[i] * x.by_sensitivity;
            add(at, by_p, by_n, w_[i] * (x.value - c_[i]));
        }
        if (gain_weight_ > 0) {
            const Scalar length = at.sensitivity.norm();
            add(at, Vec3<Scalar>::Zero(), Vec3<Scalar>(at.sensitivity * (gain_weight_ / length)),
                gain_weight_ * (length - params_.gain));
        }
    }

    /// Levenberg-Marquardt over the position.
    [[gnu::noinline]] SingleCoilSolution<Scalar> run(const Vec3<Scalar>& start_m) const {
        SingleCoilSolution<Scalar> result;
        Point<Scalar> at;
        if (!project(start_m, at)) {
            result.end = SingleCoilEnd::undetermined;
            result.chi_square = kNever<Scalar>;
            return result;
        }
        bool settled = false;
        Scalar damping = 0;
        while (!settled && result.iterations < params_.max_iterations) {
            linearise(at);
            settled = descend(at, damping, result.iterations);
        }
        linearise(at);
        result.pose = {at.position_m, at.sensitivity};
        result.chi_square = at.cost;
        const Scalar misfit = params_.max_misfit_share * params_.max_misfit_share * signal_;
        if (!add_covariance(at, result)) {
            result.end = SingleCoilEnd::undetermined;
        } else if (!settled) {
            result.end = SingleCoilEnd::not_converged;
        } else {
            result.end = at.cost <= gate() + misfit ? SingleCoilEnd::converged : SingleCoilEnd::wrong_minimum;
        }
        return result;
    }

    /// Signal to noise of 50 dB: noise does not make another minimum as good as the best one.
    [[nodiscard]] bool is_clear() const { return signal_ > Scalar(1e5) * Scalar(used_); }
    [[nodiscard]] Scalar gate() const { return noise_gate(Scalar(used_) + (gain_weight_ > 0 ? 1 : 0) - 6); }
    /// Difference of two costs that noise, or a misfit of the size of the best one, may cause.
    [[nodiscard]] Scalar margin(Scalar best) const { return 20 * std::max(Scalar(1), best / gate()); }

private:
    static void add(Point<Scalar>& at, const Vec3<Scalar>& by_p, const Vec3<Scalar>& by_n, Scalar residual) {
        at.by_p += by_p * by_p.transpose();
        at.by_pn += by_p * by_n.transpose();
        at.by_n += by_n * by_n.transpose();
        at.gradient_p += residual * by_p;
        at.gradient_n += residual * by_n;
    }

    /// Tries steps with growing damping until one does not increase the cost. True if the step was small.
    bool descend(Point<Scalar>& at, Scalar& damping, int& iterations) const {
        const Mat3<Scalar> gain = at.by_pn * at.by_n.inverse();
        const Mat3<Scalar> information = at.by_p - gain * at.by_pn.transpose();
        const Vec3<Scalar> gradient = at.gradient_p - gain * at.gradient_n;
        while (iterations < params_.max_iterations) {
            ++iterations;
            Mat3<Scalar> damped = information;
            damped.diagonal() *= 1 + damping;
            Vec3<Scalar> step = damped.inverse() * -gradient;
            step /= std::max(Scalar(1), step.norm() / (params_.max_step * at.nearest_m));
            Point<Scalar> trial;
            const bool tiny = step.norm() < params_.step_tolerance * at.nearest_m;
            if (step.allFinite() && project(at.position_m + step, trial) && (tiny || trial.cost <= at.cost)) {
                at = trial;
                const bool settled = tiny && damping < Scalar(1e-2);
                damping = damping > Scalar(1e-4) ? damping / 10 : Scalar(0);
                return settled;
            }
            damping = std::max(damping * 8, Scalar(1e-2));
        }
        return false;
    }

    /// Covariance of (position, axis) and of the gain. False if the couplings do not determine them.
    [[gnu::noinline]] bool add_covariance(const Point<Scalar>& at, SingleCoilSolution<Scalar>& result) const {
        // In units of the distance and of the gain.
        const Scalar gain = at.sensitivity.norm();
        Mat6<Scalar> information;
        information.template topLeftCorner<3, 3>() = (at.nearest_m * at.nearest_m) * at.by_p;
        information.template topRightCorner<3, 3>() = (at.nearest_m * gain) * at.by_pn;
        information.template bottomLeftCorner<3, 3>() = information.template topRightCorner<3, 3>().transpose();
        information.template bottomRightCorner<3, 3>() = (gain * gain) * at.by_n;
        const Cholesky<Scalar, 6> cholesky(information);
        if (!cholesky.ok()) {
            return false;
        }
        const Mat6<Scalar> inverse = cholesky.template solve<6>(Mat6<Scalar>::Identity());
        const Vec3<Scalar> axis = at.sensitivity / gain;
        Mat6<Scalar> to_axis = Mat6<Scalar>::Identity();
        to_axis.template bottomRightCorner<3, 3>() -= axis * axis.transpose();
        result.covariance = to_axis * inverse * to_axis.transpose();
        const Scalar limit = params_.max_deviation_share * params_.max_deviation_share;
        const Scalar of_position = result.covariance.template topLeftCorner<3, 3>().trace();
        const Scalar of_axis = result.covariance.template bottomRightCorner<3, 3>().trace();
        result.gain_deviation = std::sqrt(axis.dot(Mat3<Scalar>(inverse.template bottomRightCorner<3, 3>()) * axis));
        Vec6<Scalar> units = Vec6<Scalar>::Ones();
        units.template head<3>().setConstant(at.nearest_m);
        result.covariance = units.asDiagonal() * result.covariance * units.asDiagonal();
        return of_position < limit && of_axis < limit;
    }

    const field::Generator<Scalar>& generator_;
    std::span<const Scalar> c_;
    std::span<const Scalar> w_;
    const SingleCoilParams<Scalar>& params_;
    Scalar gain_weight_ = 0;  // zero: the gain is unknown
    Scalar signal_ = 0;       // squared norm of the weighted couplings
    int used_ = 0;            // coils with a weight
};

/// Weights of a search. Near a source coil its coupling is far above the others and, with weights of noise, makes the region from
/// which steps lead to the minimum small: here each coupling also has a relative error.
template <typename Scalar>
class SearchWeights {
public:
    SearchWeights(std::span<const Scalar> couplings, std::span<const Scalar> weights) : size_(couplings.size()) {
        Scalar squares = 0;
        for (std::size_t i = 0; i < size_; ++i) {
            squares += weights[i] > 0 ? couplings[i] * couplings[i] : Scalar(0);
        }
        for (std::size_t i = 0; i < size_; ++i) {
            const Scalar own = Scalar(0.1) * std::abs(couplings[i]) * weights[i];
            const Scalar common = Scalar(0.01) * std::sqrt(squares) * weights[i];
            weights_[i] = weights[i] / std::sqrt(1 + own * own + common * common);
        }
    }

    [[nodiscard]] std::span<const Scalar> all() const { return {weights_.data(), size_}; }

private:
    std::array<Scalar, field::kMaxGeneratorCoils> weights_{};
    std::size_t size_;
};

/// Starts in 26 directions (faces, edges and corners of a cube) at several distances from the middle of the coils.
template <typename Scalar>
class Starts {
public:
    static constexpr int kKept = 64;

    Starts(const Fit<Scalar>& fit, const field::Generator<Scalar>& generator, const Vec3<Scalar>& side) {
        constexpr Scalar kDistances[]{Scalar(0.4), Scalar(0.6), Scalar(0.8), Scalar(1), Scalar(1.3),
                                      Scalar(1.7), Scalar(2.2), Scalar(3),   Scalar(4), Scalar(5.5)};
        const Vec3<Scalar> centre = centre_of(generator);
        Scalar radius = 0;
        for (const auto& coil : generator) {
            radius = std::max(radius, (coil.position_m - centre).norm());
        }
        for (int cell = 0; cell < 27; ++cell) {
            const Vec3<Scalar> u =
                Vec3<Scalar>(Scalar(cell % 3 - 1), Scalar(cell / 3 % 3 - 1), Scalar(cell / 9 - 1)).normalized();
            if (cell == 13 || (!side.isZero(0) && !(u.dot(side) > 0))) {
                continue;
            }
            for (const Scalar distance : kDistances) {
                Point<Scalar> at;
                if (fit.project(centre + (distance * radius) * u, at)) {
                    keep(at);
                }
            }
        }
    }

    [[nodiscard]] int size() const { return size_; }
    [[nodiscard]] const Vec3<Scalar>& operator[](int i) const { return positions_[static_cast<std::size_t>(i)]; }

private:
    void keep(const Point<Scalar>& at) {
        int place = size_;
        while (place > 0 && costs_[static_cast<std::size_t>(place - 1)] > at.cost) {
            --place;
        }
        if (place == kKept) {
            return;
        }
        size_ = std::min(size_ + 1, kKept);
        for (auto i = static_cast<std::size_t>(size_ - 1); i > static_cast<std::size_t>(place); --i) {
            costs_[i] = costs_[i - 1];
            positions_[i] = positions_[i - 1];
        }
        costs_[static_cast<std::size_t>(place)] = at.cost;
        positions_[static_cast<std::size_t>(place)] = at.position_m;
    }

    std::array<Scalar, kKept> costs_{};
    std::array<Vec3<Scalar>, kKept> positions_{};
    int size_ = 0;
};

template <typename Scalar>
bool is_minimum(const SingleCoilSolution<Scalar>& found) {
    return found.end == SingleCoilEnd::converged || found.end == SingleCoilEnd::wrong_minimum;
}

}  // namespace

template <typename Scalar>
Result<SingleCoilSolution<Scalar>> refine_single_coil(const field::Generator<Scalar>& generator,
                                                      std::span<const Scalar> couplings, std::span<const Scalar> weights,
                                                      const Vec3<Scalar>& start_m, const SingleCoilParams<Scalar>& params) {
    Fit<Scalar> fit(generator, couplings, weights, params);
    const Status status = fit.check();
    if (!status.ok()) {
        return status;
    }
    return fit.run(start_m);
}

template <typename Scalar>
Result<SingleCoilSolution<Scalar>> solve_single_coil(const field::Generator<Scalar>& generator, std::span<const Scalar> couplings,
                                                     std::span<const Scalar> weights, const SingleCoilParams<Scalar>& params) {
    Fit<Scalar> fit(generator, couplings, weights, params);
    const Status status = fit.check();
    if (!status.ok()) {
        return status;
    }
    const Vec3<Scalar> centre = centre_of(generator);
    const SearchWeights<Scalar> soft(couplings, weights);
    Fit<Scalar> coarse(generator, couplings, soft.all(), params);
    (void)coarse.check();
    const Starts<Scalar> starts(coarse, generator, params.side);
    SingleCoilSolution<Scalar> best;
    best.end = SingleCoilEnd::undetermined;
    best.chi_square = kNever<Scalar>;
    const int enough = fit.is_clear() ? 8 : Starts<Scalar>::kKept;
    Scalar second = kNever<Scalar>;  // least cost of another minimum
    for (int i = 0; i < starts.size() && (i < enough || !best.converged()); ++i) {
        const auto near = coarse.run(starts[i]);
        const auto found = fit.run(near.pose.position_m);
        best.iterations += near.iterations + found.iterations;
        if (!params.side.isZero(0) && !((found.pose.position_m - centre).dot(params.side) > 0)) {
            continue;
        }
        const Scalar apart = (found.pose.position_m - best.pose.position_m).norm();
        const bool is_other = !(apart < Scalar(0.02) * (best.pose.position_m - centre).norm());
        if (found.chi_square < best.chi_square) {
            second = is_other && is_minimum(best) ? best.chi_square : second;
            const int iterations = best.iterations;
            best = found;
            best.iterations = iterations;
        } else if (is_other && is_minimum(found)) {
            second = std::min(second, found.chi_square);
        }
    }
    if (best.converged() && second - best.chi_square < fit.margin(best.chi_square)) {
        best.end = SingleCoilEnd::ambiguous;
    }
    return best;
}

#if TRICOIL_FLOAT_TRACKERS
template Result<SingleCoilSolution<float>> refine_single_coil(const field::Generator<float>&, std::span<const float>,
                                                              std::span<const float>, const Vec3<float>&,
                                                              const SingleCoilParams<float>&);
template Result<SingleCoilSolution<float>> solve_single_coil(const field::Generator<float>&, std::span<const float>,
                                                             std::span<const float>, const SingleCoilParams<float>&);
#endif
#if TRICOIL_DOUBLE
template Result<SingleCoilSolution<double>> refine_single_coil(const field::Generator<double>&, std::span<const double>,
                                                               std::span<const double>, const Vec3<double>&,
                                                               const SingleCoilParams<double>&);
template Result<SingleCoilSolution<double>> solve_single_coil(const field::Generator<double>&, std::span<const double>,
                                                              std::span<const double>, const SingleCoilParams<double>&);
#endif

}  // namespace tricoil::solver
