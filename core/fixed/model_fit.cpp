#include "core/fixed/model_fit.hpp"

#include <algorithm>

namespace tricoil::fixed {

ModelFit fit_of(const NormalisedBlock& x, Scaled coupling_constant, const VectorPose& pose) {
    const Scaled range = normalise(pose.range_m.raw(), -Metres::kFractionBits);
    const Scaled strength = divide(coupling_constant, multiply(multiply(range, range), range));
    // In units of the block, k is at most 3 for a pose solved from x. Values above 4 are clamped.
    const Entry k = std::min(to_fixed<28>({strength.mantissa, strength.exponent - x.exponent}), Entry(4));
    // k O D(u) = k (3 (O u) u^T - O) / 2. The bracket is at most 3 + 1 plus rounding, stored in Q28 (up to 8).
    const Vec3<Unit> v = multiply<30>(pose.attitude, pose.direction);
    std::uint64_t misfit_q52 = 0;
    std::uint64_t power_q56 = 0;  // at most 9 * 2^56
    for (Index i = 0; i < 3; ++i) {
        for (Index j = 0; j < 3; ++j) {
            const std::int64_t along = 3 * (std::int64_t{v(i).raw()} * pose.direction(j).raw() >> 2);  // Q58, below 2^62
            const std::int64_t bracket = shift_right_rounded(along, 30) - shift_right_rounded(pose.attitude(i, j).raw(), 2);
            const std::int64_t model_q26 = shift_right_rounded(k.raw() * std::int64_t{saturate(bracket)}, 31);
            const std::int64_t y = x.y(i, j).raw();
            const std::int64_t off = shift_right_rounded(y, 2) - model_q26;  // at most 17: nine squares below 2^64
            misfit_q52 += static_cast<std::uint64_t>(off * off);
            power_q56 += static_cast<std::uint64_t>(y * y);
        }
    }
    ModelFit fit;
    fit.strength = strength;
    const auto halved = static_cast<std::int64_t>(misfit_q52 >> 1);
    fit.misfit_squared = normalise(halved, 2 * x.exponent - 51);
    fit.misfit_share = ratio(halved, static_cast<std::int64_t>(power_q56 >> 5));
    // Entries at most one: the cross product at most 2, the determinant 6.
    fit.right_handed = dot<27>(x.y.col(0), cross<28>(x.y.col(1), x.y.col(2))).raw() > 0;
    return fit;
}

}  // namespace tricoil::fixed
