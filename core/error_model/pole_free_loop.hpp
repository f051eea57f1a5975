// What the pole-free form leaves in closed loop: (37) and the exact step, with the loop's own turn per update.
#pragma once

#include "core/error_model/kappa.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::error_model {

/// Predicts the position that the pole-free form measures, from the true positions alone, one update after the other. Assumes a
/// known attitude, as all of (19)-(37); the form's roll by the mean of (16) leaves a fixed attitude untouched, so there it is
/// exact. One pass: nearly all of the error is range, by (37).
template <typename Scalar>
class PoleFreeLoop {
public:
    /// start: the first true position, at which the estimate is taken to be right.
    PoleFreeLoop(int passes, const Vec3<Scalar>& start_m)
        : passes_(passes), range_m_(start_m.norm()), direction_(start_m.normalized()) {}

    /// The update that sees the true position `now_m`. Not a number beyond the step's domain, 54.7 degrees.
    void update(const Vec3<Scalar>& now_m) {
        const Scalar range = now_m.norm();
        const Vec3<Scalar> u = now_m / range;
        for (int pass = 0; pass < passes_; ++pass) {
            // Exactly, for any step: across the estimate, (2 / kappa) cos(g) of what u has there.
            const Scalar cosine = direction_.dot(u);
            const Scalar kappa = 3 * cosine * cosine - 1;
            const Vec3<Scalar> across = u - cosine * direction_;
            range_m_ = range - range_error(range, kappa);
            direction_ = (direction_ + (2 / kappa) * cosine * across).normalized();
        }
    }

    [[nodiscard]] Scalar measured_range_m() const { return range_m_; }
    [[nodiscard]] const Vec3<Scalar>& measured_direction() const { return direction_; }

private:
    int passes_;
    Scalar range_m_;
    Vec3<Scalar> direction_;
};

}  // namespace tricoil::error_model
