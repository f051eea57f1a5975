#include "core/solver/direct_near_metal.hpp"

#include "core/base/precision.hpp"
#include "core/field/induced_field.hpp"

namespace tricoil::solver {

template <typename Scalar>
Result<DirectSolution<Scalar>> solve_near_metal(const field::InducedDipoles<Scalar>& metal, const Mat3<Scalar>& x,
                                                Scalar coupling_constant, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o) {
    constexpr int kMaxIterations = 20;
    constexpr Scalar kSettled = Scalar(2e-5);  // relative to the range; the next steps are smaller
    Vec3<Scalar> position = position_m;
    Mat3<Scalar> attitude = o;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
        const auto solved = solve_direct<Scalar>(x - field::induced_couplings(metal, position, attitude), coupling_constant);
        if (!solved.ok()) {
            return solved;
        }
        DirectSolution<Scalar> solution = *solved;
        if (solution.direction.dot(position) < 0) {
            solution.direction = -solution.direction;
        }
        const Vec3<Scalar> next = solution.range_m * solution.direction;
        const Scalar step = (next - position).norm();
        if (step <= kSettled * solution.range_m) {
            return solution;
        }
        position = next;
        attitude = solution.attitude;
    }
    return Status{StatusCode::not_converged, "no pose near the start explains the couplings with the metal of the calibration"};
}

template Result<DirectSolution<float>> solve_near_metal(const field::InducedDipoles<float>&, const Mat3<float>&, float,
                                                        const Vec3<float>&, const Mat3<float>&);
#if TRICOIL_SCALARS & 2  // double
template Result<DirectSolution<double>> solve_near_metal(const field::InducedDipoles<double>&, const Mat3<double>&, double,
                                                         const Vec3<double>&, const Mat3<double>&);
#endif

}  // namespace tricoil::solver
