// Interface between filter and field model, and its implementation for the concentric dipole.
#pragma once

#include <concepts>

#include "core/base/status.hpp"
#include "core/field/induced_field.hpp"
#include "core/solver/direct_near_metal.hpp"

namespace tricoil::tracking::scaat {

/// Pose for a start of the filter, with diagnostics of the signal matrix.
template <typename Scalar>
struct StartPose {
    Vec3<Scalar> position_m;
    Mat3<Scalar> attitude;      // O: source components to sensor components
    Scalar strength;            // k, coupling units: coupling strength at this pose
    Scalar misfit_squared;      // coupling units squared, 3 degrees of freedom
    bool right_handed;          // false: a coil is reversed or two are swapped
    bool hemisphere_from_data;  // the couplings determine the sign of the position (only with coil offsets)
};

/// column(p, O, j): coupling column j at a pose with its Jacobian by position (1/m) and small rotation (1/rad), source frame.
template <typename Model, typename Scalar>
concept ColumnField = requires(const Model& model, const Vec3<Scalar>& p, const Mat3<Scalar>& m, int j) {
    { model.column(p, m, j) } -> std::same_as<field::ColumnModel<Scalar>>;
};

/// Requirements on a measurement model:
///   column(p, O, j)  as above, j from 0 to 2;
///   start(X)         pose of three columns taken as simultaneous, without prior knowledge; errors as solve_direct;
///   near(X, p, q)    the same, near the pose (p, q);
///   is_even()        true if X is the same at -p, so that a state has a mirror image.
template <typename Model, typename Scalar>
concept MeasurementModel = ColumnField<Model, Scalar> &&
    requires(const Model& model, const Vec3<Scalar>& p, const Mat3<Scalar>& m) {
    { model.start(m) } -> std::same_as<Result<StartPose<Scalar>>>;
    { model.near(m, p, Quat<Scalar>()) } -> std::same_as<Result<StartPose<Scalar>>>;
    { model.is_even() } -> std::convertible_to<bool>;
};

/// Concentric triads, (6), and metal at rest. Without metal X is even in the position, at rest and in motion: no trajectory
/// determines the hemisphere. Far metal shows it only within noise. So start() does not resolve it.
template <typename Scalar>
struct ConcentricMeasurement {
    Scalar coupling_constant = 1;                                 // C, coupling units times m^3
    const field::InducedDipoles<Scalar>* surroundings = nullptr;  // null: no metal

    [[nodiscard]] bool is_even() const { return surroundings == nullptr; }

    [[nodiscard]] field::ColumnModel<Scalar> column(const Vec3<Scalar>& position_m, const Mat3<Scalar>& o, int j) const {
        return surroundings == nullptr ? field::column_model(coupling_constant, position_m, o, j)
                                       : column_near_metal(position_m, o, j);
    }

    [[nodiscard]] Result<StartPose<Scalar>> start(const Mat3<Scalar>& x) const {
        const auto direct = solver::solve_direct(x, coupling_constant);
        if (!direct.ok()) {
            return direct.status();
        }
        return surroundings == nullptr ? start_pose(*direct) : start_near_metal(x, *direct);
    }

    /// Without metal the direct solution does not need the given pose, which only determines the sign of the position.
    [[nodiscard]] Result<StartPose<Scalar>> near(const Mat3<Scalar>& x, const Vec3<Scalar>& position_m,
                                                 const Quat<Scalar>& q) const {
        if (surroundings != nullptr) {
            const auto solved = solver::solve_near_metal<Scalar>(*surroundings, x, coupling_constant, position_m,
                                                                 q.toRotationMatrix().transpose());
            return solved.ok() ? start_pose(*solved) : start(x);
        }
        auto pose = start(x);
        if (!pose.ok() || pose->position_m.dot(position_m) >= 0) {
            return pose;
        }
        StartPose<Scalar> mirrored = *pose;
        mirrored.position_m = -mirrored.position_m;
        return mirrored;
    }

private:
    static StartPose<Scalar> start_pose(const solver::DirectSolution<Scalar>& direct) {
        return {direct.range_m * direct.direction,
                direct.attitude,
                direct.strength,
                direct.misfit_squared,
                direct.right_handed,
                false};
    }

    /// Not inlined, so that column() stays short without metal.
    [[nodiscard, gnu::noinline]] field::ColumnModel<Scalar> column_near_metal(const Vec3<Scalar>& position_m,
                                                                              const Mat3<Scalar>& o, int j) const {
        auto column = field::column_model(coupling_constant, position_m, o, j);
        field::add_induced(*surroundings, position_m, o, j, column);
        return column;
    }

    /// Not inlined, to save stack.
    [[nodiscard, gnu::noinline]] Result<StartPose<Scalar>> start_near_metal(const Mat3<Scalar>& x,
                                                                            const solver::DirectSolution<Scalar>& plain) const {
        const Vec3<Scalar> position_m = plain.range_m * plain.direction;
        auto solved = solver::solve_near_metal<Scalar>(*surroundings, x, coupling_constant, position_m, plain.attitude);
        if (!solved.ok()) {
            solved = solver::solve_near_metal<Scalar>(*surroundings, x, coupling_constant, -position_m, plain.attitude);
        }
        if (!solved.ok()) {
            return solved.status();
        }
        return start_pose(*solved);
    }
};

}  // namespace tricoil::tracking::scaat
