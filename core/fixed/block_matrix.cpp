#include "core/fixed/block_matrix.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::int64_t kOneQ30 = std::int64_t{1} << 30;

}  // namespace

NormalisedBlock normalise(const BlockMatrix& x) {
    std::uint64_t all = 0;
    for (Index i = 0; i < 9; ++i) {
        all |= size_of(x.mantissa(i));  // its highest bit is that of the largest entry
    }
    NormalisedBlock block;
    if (all == 0) {
        return block;
    }
    const int shift = excess_bits(all, Entry::kFractionBits);
    block.y = x.mantissa.unaryExpr(
        [shift](std::int32_t entry) { return Entry::from_raw(static_cast<std::int32_t>(scaled_down(entry, shift))); });
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
    const Vec3<std::int64_t> w = v.unaryExpr([shift](std::int64_t entry) { return scaled_down(entry, shift); });
    const auto norm =
        static_cast<std::int64_t>(square_root(static_cast<std::uint64_t>(w.squaredNorm())));  // 2^29 to sqrt(3) * 2^30
    const std::int64_t reciprocal = ((std::int64_t{1} << 60) + norm / 2) / norm;
    return w.unaryExpr(
        [reciprocal](std::int64_t entry) { return Unit::from_raw(saturate(shift_right_rounded(entry * reciprocal, 30))); });
}

Matrix<Unit, 3, 2> transverse_axes(const Vec3<Unit>& x) {
    const bool down = x.z().raw() < 0;
    const Unit sign = Unit::from_raw(static_cast<std::int32_t>(down ? -kOneQ30 : kOneQ30));
    const std::int64_t denominator = kOneQ30 + static_cast<std::int64_t>(size_of(x.z().raw()));  // 1 to 2
    const auto inverse = static_cast<std::int32_t>(((std::int64_t{1} << 60) + denominator / 2) / denominator);
    const Unit a = Unit::from_raw(down ? inverse : -inverse);
    const auto flip = [down](Unit value) { return down ? -value : value; };
    const Unit b = x.x() * x.y() * a;
    Matrix<Unit, 3, 2> axes;
    axes.col(0) << Unit(1) + flip(x.x() * x.x() * a), flip(b), flip(-x.x());
    axes.col(1) << b, sign + x.y() * x.y() * a, -x.y();
    return axes;
}

Quotients::Quotients(std::int64_t denominator) {
    if (denominator <= 0) {
        return;
    }
    shift_ = std::max(excess_bits(static_cast<std::uint64_t>(denominator), 31), 0);
    divisor_ = static_cast<std::uint32_t>(shift_right_rounded(denominator, shift_));  // at most 2^31
    up_ = std::countl_zero(divisor_);
    inverse_ =
        static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()) / (divisor_ << up_));
}

Unit Quotients::of(std::int64_t numerator) const {
    const std::int64_t dividend = shift_right_rounded(numerator, shift_);
    const std::uint64_t size = size_of(dividend);
    if (size >= 2 * std::uint64_t{divisor_}) {
        return size == 0 ? Unit(0) : (dividend > 0 ? Unit::largest() : Unit::smallest());
    }
    // With 2^63 / (divisor 2^up), rounded down, the product is at most two units too small.
    const auto half = static_cast<std::uint32_t>((size << up_) >> 1);
    auto quotient = static_cast<std::uint32_t>((std::uint64_t{half} * inverse_) >> 32);
    std::uint64_t rest = (size << 30) - std::uint64_t{quotient} * divisor_;
    for (; rest >= divisor_; rest -= divisor_) {
        ++quotient;
    }
    const auto magnitude = static_cast<std::int32_t>(quotient);
    return Unit::from_raw(dividend < 0 ? -magnitude : magnitude);
}

}  // namespace tricoil::fixed
