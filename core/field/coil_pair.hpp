// Coupling between one source coil and one sensor coil in free space: dipole and octupole (coils of finite size).
#pragma once

#include <cmath>

#include "core/linear/matrix.hpp"

namespace tricoil::field {

/// Coupling and its gradients. For a point-like sensor coil the coupling is linear in its sensitivity, so by_sensitivity is the
/// field.
template <typename Scalar>
struct PairCoupling {
    Scalar value;
    Vec3<Scalar> by_displacement_per_m;  // d value / d r
    Vec3<Scalar> by_sensitivity;         // d value / d n

    PairCoupling& operator+=(const PairCoupling& other) {
        value += other.value;
        by_displacement_per_m += other.by_displacement_per_m;
        by_sensitivity += other.by_sensitivity;
        return *this;
    }
};

/// X = n.B(r) with B = (3 (u.m) u - m) / (2 |r|^3), u = r / |r|: (4)-(6) for one pair of coils.
/// r_m: from source coil to sensor coil, not zero; moment m: coupling units times m^3; sensitivity n: no unit. All in one
/// coordinate frame.
template <typename Scalar>
PairCoupling<Scalar> dipole_pair(const Vec3<Scalar>& r_m, const Vec3<Scalar>& moment, const Vec3<Scalar>& sensitivity) {
    using std::sqrt;
    const Scalar inverse = Scalar(1) / sqrt(r_m.squaredNorm());
    const Vec3<Scalar> u = r_m * inverse;
    const Scalar strength = Scalar(0.5) * inverse * inverse * inverse;
    const Scalar um = u.dot(moment);
    const Scalar un = u.dot(sensitivity);
    const Vec3<Scalar> b = strength * (Scalar(3) * um * u - moment);
    // dX/dr = (3 / 2 r^4) ((u.m) n + (u.n) m + (m.n - 5 (u.m)(u.n)) u): symmetric in the two coils.
    const Scalar along = moment.dot(sensitivity) - Scalar(5) * um * un;
    const Vec3<Scalar> gradient = (Scalar(3) * strength * inverse) * (um * sensitivity + un * moment + along * u);
    return {sensitivity.dot(b), gradient, b};
}

/// (n.grad)(a.grad)^3 (1 / 2|r|) for a unit vector a: the coupling of a point-like coil n to the axial octupole along a.
/// With alpha = a.u, beta = n.u, gamma = a.n it is (105 alpha^3 beta - 45 alpha^2 gamma - 45 alpha beta + 9 gamma) / (2 |r|^5).
/// `by_axis`: gradient with respect to a, over all three factors a, for rotations of a.
template <typename Scalar>
struct OctupoleCoupling {
    Scalar value;
    Vec3<Scalar> by_displacement_per_m;
    Vec3<Scalar> by_sensitivity;
    Vec3<Scalar> by_axis;
};

template <typename Scalar>
OctupoleCoupling<Scalar> octupole_pair(const Vec3<Scalar>& r_m, const Vec3<Scalar>& axis, const Vec3<Scalar>& sensitivity) {
    using std::sqrt;
    const Scalar inverse = Scalar(1) / sqrt(r_m.squaredNorm());
    const Vec3<Scalar> u = r_m * inverse;
    const Scalar square = inverse * inverse;
    const Scalar strength = Scalar(0.5) * square * square * inverse;
    const Scalar alpha = axis.dot(u);
    const Scalar beta = sensitivity.dot(u);
    const Scalar gamma = axis.dot(sensitivity);
    const Scalar by_beta = Scalar(105) * alpha * alpha * alpha - Scalar(45) * alpha;
    const Scalar by_gamma = Scalar(9) - Scalar(45) * alpha * alpha;
    const Scalar by_alpha = Scalar(315) * alpha * alpha * beta - Scalar(90) * alpha * gamma - Scalar(45) * beta;
    const Scalar value = strength * (by_beta * beta + by_gamma * gamma);
    OctupoleCoupling<Scalar> result;
    result.value = value;
    // d alpha / dr = (a - alpha u) / r, d beta / dr = (n - beta u) / r, d r^-5 / dr = -5 u / r^6.
    result.by_displacement_per_m = (strength * inverse) * (by_alpha * (axis - alpha * u) + by_beta * (sensitivity - beta * u)) -
                                   (Scalar(5) * value * inverse) * u;
    result.by_sensitivity = strength * (by_beta * u + by_gamma * axis);
    // The expression above uses a.a = 1, so its gradient along a has no meaning. Rotations of a do not need that component.
    result.by_axis = strength * (by_alpha * u + by_gamma * sensitivity);
    return result;
}

}  // namespace tricoil::field
