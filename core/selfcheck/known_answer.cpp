#include "core/selfcheck/known_answer.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::selfcheck {
namespace {

template <typename Scalar>
double worst_of(const Scalar* result, const double* answer, Index count) {
    Scalar worst = 0;
    for (Index n = 0; n < count; ++n) {
        const Scalar difference = std::abs(result[n] - static_cast<Scalar>(answer[n]));
        if (!std::isfinite(difference)) {
            return kInfinite;
        }
        worst = std::max(worst, difference);
    }
    return static_cast<double>(worst);
}

}  // namespace

double worst_difference(const float* result, const double* answer, Index count) { return worst_of(result, answer, count); }
double worst_difference(const double* result, const double* answer, Index count) { return worst_of(result, answer, count); }

}  // namespace tricoil::selfcheck
