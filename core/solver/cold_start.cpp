#include "core/solver/cold_start.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/precision.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
using Model = field::GeneralDipole<Scalar>;

/// Converts couplings to those of ideal concentric triads, and back.
template <typename Scalar>
struct Gains {
    explicit Gains(const Model<Scalar>& model)
        : source_inverse(model.source_moment.inverse()), sensor_inverse(model.sensor_sensitivity.transpose().inverse()) {}

    [[nodiscard]] Mat3<Scalar> undo(const Mat3<Scalar>& x) const { return sensor_inverse * x * source_inverse; }

    Mat3<Scalar> source_inverse;
    Mat3<Scalar> sensor_inverse;
};

template <typename Scalar>
RigidPose<Scalar> pose_of(const DirectSolution<Scalar>& solution, const Vec3<Scalar>& towards) {
    return {solution.position_towards(towards), geometry::attitude_quaternion(solution.attitude)};
}

template <typename Scalar>
Mat3<Scalar> model_at(const Model<Scalar>& model, const RigidPose<Scalar>& pose) {
    return field::signal_matrix<Scalar>(model, pose.position_m, pose.q_source_sensor.toRotationMatrix().transpose());
}

/// Couplings of ideal concentric triads if the sensor is at `guess`, where the model's couplings are `modelled`.
template <typename Scalar>
Mat3<Scalar> as_concentric(const Gains<Scalar>& gains, const Mat3<Scalar>& x, const RigidPose<Scalar>& guess,
                           const Mat3<Scalar>& modelled) {
    const Mat3<Scalar> ideal =
        field::signal_matrix<Scalar>(Scalar(1), guess.position_m, guess.q_source_sensor.toRotationMatrix().transpose());
    return gains.undo(x - modelled) + ideal;
}

/// The model with both origins at the centres of the coils, where one dipole is the best approximation of all three.
template <typename Scalar>
struct Centred {
    explicit Centred(const Model<Scalar>& original)
        : model(original),
          source_m(original.source_offset_m.rowwise().mean()),
          sensor_m(original.sensor_offset_m.rowwise().mean()) {
        model.source_offset_m.colwise() -= source_m;
        model.sensor_offset_m.colwise() -= sensor_m;
        for (field::InducedDipole<Scalar>& dipole : model.surroundings) {
            dipole.position_m -= source_m;
        }
    }

    /// Converts a pose between centred frames to one between the original frames.
    [[nodiscard]] RigidPose<Scalar> original(const RigidPose<Scalar>& pose) const {
        return {pose.position_m + source_m - pose.q_source_sensor * sensor_m, pose.q_source_sensor};
    }

    Model<Scalar> model;
    Vec3<Scalar> source_m;
    Vec3<Scalar> sensor_m;
};

/// Start of a search: a pose and its misfit.
template <typename Scalar>
struct Start {
    RigidPose<Scalar> pose;
    Scalar cost = std::numeric_limits<Scalar>::max();
};

template <typename Scalar>
Start<Scalar> rated(const Mat3<Scalar>& modelled, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                    const RigidPose<Scalar>& pose) {
    const Scalar cost = weights.cwiseProduct(modelled - x).squaredNorm();
    return {pose, std::isfinite(cost) ? cost : std::numeric_limits<Scalar>::max()};
}

/// Returns the best of the passes, because near the coils they may not converge. Ends earlier if a pass to a misfit below `small`
/// hardly reduces it: the rest is noise. Not inlined, like the other stages of the search, so that their stack use does not add
/// up.
template <typename Scalar>
[[gnu::noinline]] Start<Scalar> best_pass(const Model<Scalar>& model, const Gains<Scalar>& gains, const Mat3<Scalar>& x,
                                          const Mat3<Scalar>& weights, RigidPose<Scalar> pose, int passes, Scalar small) {
    constexpr Scalar kHardly = Scalar(0.5);
    Mat3<Scalar> modelled = model_at(model, pose);
    Start<Scalar> best = rated(modelled, x, weights, pose);
    for (int pass = 0; pass < passes; ++pass) {
        const auto solution = solve_direct<Scalar>(as_concentric(gains, x, pose, modelled), Scalar(1));
        if (!solution.ok()) {
            break;
        }
        pose = pose_of<Scalar>(*solution, pose.position_m);
        modelled = model_at(model, pose);
        const Start<Scalar> next = rated(modelled, x, weights, pose);
        const bool settled = next.cost < small && next.cost > kHardly * best.cost;
        if (next.cost < best.cost) {
            best = next;
        }
        if (settled) {
            break;
        }
    }
    return best;
}

/// One search; keeps the best refinement so far.
template <typename Scalar>
class Search {
public:
    Search(const Model<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights, const ColdStartParams<Scalar>& params)
        : model_(model),
          x_(x),
          weights_(weights),
          params_(params),
          centred_(model),
          gains_(model),
          small_(params.refine.max_misfit_share * params.refine.max_misfit_share * weights.cwiseProduct(x).squaredNorm()) {}

    Status run() {
        const bool known = params_.hemisphere.squaredNorm() > 0;
        RigidPose<Scalar> near;
        Status status = solve_concentric(known, near);
        if (status.ok()) {
            status = try_hemispheres(near, known);
        }
        const bool all_sides = !best_.refinement.converged() || (!is_unambiguous() && is_near_coils());
        return status.ok() && all_sides ? try_directions(near.position_m.norm()) : status;
    }

    [[nodiscard]] const ColdSolution<Scalar>& best() const { return best_; }

private:
    /// Direct solution as if the coils were ideal concentric triads.
    [[gnu::noinline]] Status solve_concentric(bool known, RigidPose<Scalar>& near) {
        const auto direct = solve_direct<Scalar>(gains_.undo(x_), Scalar(1));
        if (!direct.ok()) {
            return direct.status();
        }
        best_.right_handed = direct->right_handed;
        near = pose_of<Scalar>(*direct, known ? params_.hemisphere : direct->direction);
        return {};
    }

    /// Refines the better hemisphere; also the other one, unless the misfit of the first is small enough.
    [[gnu::noinline]] Status try_hemispheres(const RigidPose<Scalar>& near, bool known) {
        Start<Scalar> first = best_pass(centred_.model, gains_, x_, weights_, near, params_.passes, small_);
        if (known) {
            return try_start(first.pose);
        }
        const RigidPose<Scalar> far{-near.position_m, near.q_source_sensor};
        Start<Scalar> second = best_pass(centred_.model, gains_, x_, weights_, far, params_.passes, small_);
        if (second.cost < first.cost) {
            std::swap(first, second);
        }
        const Status status = try_start(first.pose);
        return !status.ok() || is_unambiguous() ? status : try_start(second.pose);
    }

    [[nodiscard]] bool is_unambiguous() const {
        return best_.refinement.converged() &&
               best_.refinement.misfit_share < params_.clear_share * params_.refine.max_misfit_share;
    }

    /// True if the coil offsets are a large share of the range. There are then minima that are not mirror images of each other.
    [[nodiscard]] bool is_near_coils() const {
        constexpr Scalar kNearness = 7;
        const Scalar source = centred_.model.source_offset_m.colwise().norm().maxCoeff();
        const Scalar sensor = centred_.model.sensor_offset_m.colwise().norm().maxCoeff();
        return best_.refinement.pose.position_m.norm() < kNearness * (source + sensor);
    }

    /// Near the coils the direct solution is unreliable: starts from all directions, smallest misfit first. To save memory only
    /// the cost of each is stored, and the selected ones are computed again.
    [[gnu::noinline]] Status try_directions(Scalar range_m) {
        constexpr Scalar kNever = std::numeric_limits<Scalar>::infinity();
        std::array<Scalar, kDirections> costs;
        for (std::size_t i = 0; i < kDirections; ++i) {
            const Vec3<Scalar> u = direction_of(i);
            costs[i] = u.dot(params_.hemisphere) >= 0 ? start_towards(u, range_m).cost : kNever;  // zero: unknown
        }
        for (int tried = 0; tried < kDirectionStarts && !is_unambiguous(); ++tried) {
            const auto best = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
            if (costs[best] == kNever) {
                break;
            }
            costs[best] = kNever;
            const Status status = try_start(start_towards(direction_of(best), range_m).pose);
            if (!status.ok()) {
                return status;
            }
        }
        return {};
    }

    static constexpr std::size_t kDirections = 26;  // to the faces, edges and corners of a cube
    static constexpr int kDirectionStarts = 10;

    static Vec3<Scalar> direction_of(std::size_t i) {
        const int cell = static_cast<int>(i < 13 ? i : i + 1);  // skips the middle of the 3 x 3 x 3 cells
        const int row = cell / 3 % 3;
        const int layer = cell / 9;
        return Vec3<Scalar>(Scalar(cell % 3 - 1), Scalar(row - 1), Scalar(layer - 1)).normalized();
    }

    /// For a given direction u, the best attitude is the polar factor of X D(u), by (6). Then the corrected passes.
    [[gnu::noinline]] Start<Scalar> start_towards(const Vec3<Scalar>& u, Scalar range_m) {
        Mat3<Scalar> polar = gains_.undo(x_) * field::dipole_factor<Scalar>(u);
        polar /= polar.norm();
        for (int i = 0; i < 12; ++i) {  // Newton's iteration for the polar factor
            polar = Scalar(0.5) * (polar + polar.inverse().transpose());
        }
        const RigidPose<Scalar> pose{range_m * u, geometry::attitude_quaternion(polar)};
        return best_pass(centred_.model, gains_, x_, weights_, pose, 1, small_);
    }

    [[gnu::noinline]] Status try_start(const RigidPose<Scalar>& start) {
        const auto refined = minimise<Scalar>(model_, x_, weights_, centred_.original(start), params_.refine);
        if (!refined.ok()) {
            return refined.status();
        }
        ++best_.starts;
        best_.iterations += refined->iterations;
        const bool better =
            best_.starts == 1 || (refined->converged() && !best_.refinement.converged()) ||
            (refined->converged() == best_.refinement.converged() && refined->misfit_squared < best_.refinement.misfit_squared);
        if (better) {
            best_.refinement = *refined;
        }
        return {};
    }

    const Model<Scalar>& model_;
    const Mat3<Scalar>& x_;
    const Mat3<Scalar>& weights_;
    const ColdStartParams<Scalar>& params_;
    Centred<Scalar> centred_;
    Gains<Scalar> gains_;
    Scalar small_;  // squared misfit below which a pose explains the couplings
    ColdSolution<Scalar> best_;
};

}  // namespace

template <typename Scalar>
Result<ColdSolution<Scalar>> solve_cold(const Model<Scalar>& model, const Mat3<Scalar>& x, const Mat3<Scalar>& weights,
                                        const ColdStartParams<Scalar>& params) {
    Search<Scalar> search(model, x, weights, params);
    const Status status = search.run();
    if (!status.ok()) {
        return status;
    }
    return search.best();
}

#if TRICOIL_SCALARS & 1  // float
template Result<ColdSolution<float>> solve_cold(const Model<float>&, const Mat3<float>&, const Mat3<float>&,
                                                const ColdStartParams<float>&);
#endif
#if TRICOIL_SCALARS & 2  // double
template Result<ColdSolution<double>> solve_cold(const Model<double>&, const Mat3<double>&, const Mat3<double>&,
                                                 const ColdStartParams<double>&);
#endif

}  // namespace tricoil::solver
