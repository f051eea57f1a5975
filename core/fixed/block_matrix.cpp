#include "core/fixed/block_matrix.hpp"

#include <algorithm>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::int64_t kOneQ30 = std::int64_t{1} << 30;

}  // namespace

NormalisedBlock normalise(const BlockMatrix& x) {
    std::uint64_t all = 0;
    for (Eigen::Index i = 0; i < 9; ++i) {
        all |= size_of(x.mantissa(i));  // its highest bit is that of the largest entry
    }
    NormalisedBlock block;
    if (all == 0) {
        return block;
    }
    const int shift = excess_bits(all, Entry::kFractionBits);
    for (Eigen::Index i = 0; i < 9; ++i) {
        block.y(i) = Entry::from_raw(static_cast<std::int32_t>(scaled_down(x.mantissa(i), shift)));
    }
    block.exponent = bounded_exponent(x.exponent) + shift + Entry::kFractionBits;
    block.zero = false;
    return block;
}

Vec3<Unit> unit_vector(const Vec3<std::int64_t>& v) {
    // Scaled to 30 bits, so that the sum of squares is below 3 * 2^60; then one division for the reciprocal.
    const std::uint64_t all = size_of(v(0)) | size_of(v(1)) | size_of(v(2));
    if (all == 0) {
        return Vec3<Unit>::Zero();
    }
    const int shift = excess_bits(all, 30);
    Vec3<std::int64_t> w;
    std::uint64_t squared = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
        w(i) = scaled_down(v(i), shift);
        squared += static_cast<std::uint64_t>(w(i) * w(i));
    }
    const auto norm = static_cast<std::int64_t>(square_root(squared));  // 2^29 to sqrt(3) * 2^30
    const std::int64_t reciprocal = ((std::int64_t{1} << 60) + norm / 2) / norm;
    Vec3<Unit> u;
    for (Eigen::Index i = 0; i < 3; ++i) {
        u(i) = Unit::from_raw(saturate(shift_right_rounded(w(i) * reciprocal, 30)));
    }
    return u;
}

Eigen::Matrix<Unit, 3, 2> transverse_axes(const Vec3<Unit>& x) {
    const bool down = x.z().raw() < 0;
    const Unit sign = Unit::from_raw(static_cast<std::int32_t>(down ? -kOneQ30 : kOneQ30));
    const std::int64_t denominator = kOneQ30 + static_cast<std::int64_t>(size_of(x.z().raw()));  // 1 to 2
    const auto inverse = static_cast<std::int32_t>(((std::int64_t{1} << 60) + denominator / 2) / denominator);
    const Unit a = Unit::from_raw(down ? inverse : -inverse);
    const auto flip = [down](Unit value) { return down ? -value : value; };
    const Unit b = x.x() * x.y() * a;
    Eigen::Matrix<Unit, 3, 2> axes;
    axes.col(0) << Unit(1) + flip(x.x() * x.x() * a), flip(b), flip(-x.x());
    axes.col(1) << b, sign + x.y() * x.y() * a, -x.y();
    return axes;
}

Unit ratio(std::int64_t numerator, std::int64_t denominator) {
    if (denominator <= 0) {
        return numerator == 0 ? Unit(0) : (numerator > 0 ? Unit::largest() : Unit::smallest());
    }
    const int shift = std::max(excess_bits(static_cast<std::uint64_t>(denominator), 31), 0);
    const std::int64_t divisor = shift_right_rounded(denominator, shift);
    const std::int64_t dividend = shift_right_rounded(numerator, shift);
    constexpr std::int64_t kLargest = std::int64_t{1} << 32;  // beyond it the ratio exceeds two
    const std::int64_t limited = dividend > kLargest ? kLargest : (dividend < -kLargest ? -kLargest : dividend);
    return Unit::from_raw(saturate(limited * kOneQ30 / divisor));
}

}  // namespace tricoil::fixed
