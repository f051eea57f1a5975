#include <limits>

#include "core/base/precision.hpp"
#include "core/base/time.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"

namespace tricoil::selfcheck {
namespace {

/// Reads through volatile, so that the processor and not the compiler does the computation.
template <typename Scalar>
Scalar runtime(Scalar value) {
    volatile Scalar through = value;
    return through;
}

template <typename Scalar>
int denormals_lost() {
    const Scalar smallest = runtime(std::numeric_limits<Scalar>::min());
    const Scalar half = runtime(smallest / 2);
    return half > 0 && runtime(half * 2) == smallest ? 0 : 1;
}

/// Rounding to nearest, ties to even, both signs.
template <typename Scalar>
int wrong_roundings() {
    const Scalar one = runtime(Scalar(1));
    const Scalar e = std::numeric_limits<Scalar>::epsilon();
    int wrong = runtime(one + runtime(e / 2)) == one ? 0 : 1;
    wrong += runtime(one + runtime(e / 2 * Scalar(1.5))) == 1 + e ? 0 : 1;
    wrong += runtime(-one - runtime(e / 2)) == -one ? 0 : 1;
    wrong += runtime(-one - runtime(e / 2 * Scalar(1.5))) == -1 - e ? 0 : 1;
    return wrong;
}

/// No excess precision, and no compiler flags that exclude NaN and infinity.
template <typename Scalar>
int wrong_precision() {
    const Scalar one = runtime(Scalar(1));
    const Scalar e = std::numeric_limits<Scalar>::epsilon();
    const Scalar nan = runtime(std::numeric_limits<Scalar>::quiet_NaN());
    int wrong = runtime(runtime(one + e) - one) == e ? 0 : 1;
    wrong += runtime(runtime(one + e / 4) - one) == 0 ? 0 : 1;
    wrong += nan == runtime(nan) ? 1 : 0;  // true with -ffast-math
    wrong += runtime(one / runtime(Scalar(0))) > std::numeric_limits<Scalar>::max() ? 0 : 1;
    return wrong;
}

/// Time differences across 2^32 microseconds, where 32-bit counters wrap after 71.6 minutes.
int wrong_times() {
    constexpr std::int64_t kWrap = std::int64_t{1} << 32;
    volatile std::int64_t before = kWrap - 1;
    const DeviceTime time = device_time_us(before) + Microseconds{2};
    int wrong = to_us(time) == kWrap + 1 ? 0 : 1;
    wrong += time > device_time_us(before) ? 0 : 1;
    return wrong;
}

}  // namespace

template <typename Scalar>
void check_arithmetic(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    report.add(CheckId::denormals, p, "denormals lost", denormals_lost<Scalar>(), 0);
    report.add(CheckId::rounding, p, "results not rounded to nearest", wrong_roundings<Scalar>(), 0);
    report.add(CheckId::precision, p, "results of wrong precision", wrong_precision<Scalar>(), 0);
}

template void check_arithmetic<float>(Report&);
#if TRICOIL_SCALARS & 2  // double
template void check_arithmetic<double>(Report&);
#endif

void check_times(Report& report) {
    report.add(CheckId::device_time, Precision::none, "time errors across 2^32 us", wrong_times(), 0);
}

}  // namespace tricoil::selfcheck
