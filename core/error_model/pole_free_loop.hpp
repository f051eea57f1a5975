// Errors of the pole-free form in closed loop: (37) and the exact step, for the turn in each update.
#pragma once

#include "core/error_model/kappa.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::error_model {

/// Predicts the measured position of the pole-free form from the true positions, one update after the other. Assumes a known
/// attitude, as (19)-(37) do. For a fixed attitude the prediction is exact, because the roll (mean of the two forms of (16)) does
/// not change the attitude. With one pass nearly all of the error is range error (37).
template <typename Scalar>
class PoleFreeLoop {
public:
    /// start_m: first true position; the estimate is assumed correct there.
    PoleFreeLoop(int passes, const Vec3<Scalar>& start_m)
        : passes_(passes), range_m_(start_m.norm()), direction_(start_m.normalized()) {}

    /// Update at the true position `now_m`. The result is NaN for steps beyond 54.7 degrees.
    void update(const Vec3<Scalar>& now_m) {
        const Scalar range = now_m.norm();
        const Vec3<Scalar> u = now_m / range;
        for (int pass = 0; pass < passes_; ++pass) {
            // Exact for any step: perpendicular to the estimate, the step measures (2 / kappa) cos(g) times the component of u.
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
