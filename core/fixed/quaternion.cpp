#include "core/fixed/quaternion.hpp"

#include <algorithm>
#include <array>

#include "core/fixed/block_matrix.hpp"

namespace tricoil::fixed {

Quaternion attitude_quaternion(const Mat3<Unit>& o) {
    const auto entry = [&o](Index i, Index j) { return std::int64_t{o(j, i).raw()}; };  // of O's transpose
    constexpr std::int64_t kOne = std::int64_t{1} << 30;
    // Four times the square of each component, Q30. For a rotation their sum is four, so the largest is at least one.
    const std::array<std::int64_t, 4> squares{
        kOne + entry(0, 0) + entry(1, 1) + entry(2, 2), kOne + entry(0, 0) - entry(1, 1) - entry(2, 2),
        kOne - entry(0, 0) + entry(1, 1) - entry(2, 2), kOne - entry(0, 0) - entry(1, 1) + entry(2, 2)};
    const std::size_t lead = entry(0, 0) + entry(1, 1) + entry(2, 2) > 0
                                 ? 0
                                 : static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
    // Four times the products with the largest component: sums of two entries, below 2^32.
    const std::int64_t wx = entry(2, 1) - entry(1, 2);
    const std::int64_t wy = entry(0, 2) - entry(2, 0);
    const std::int64_t wz = entry(1, 0) - entry(0, 1);
    const std::int64_t xy = entry(0, 1) + entry(1, 0);
    const std::int64_t xz = entry(0, 2) + entry(2, 0);
    const std::int64_t yz = entry(1, 2) + entry(2, 1);
    const std::array<std::array<std::int64_t, 4>, 4> rows{
        {{squares[0], wx, wy, wz}, {wx, squares[1], xy, xz}, {wy, xy, squares[2], yz}, {wz, xz, yz, squares[3]}}};
    const std::int64_t square = std::max<std::int64_t>(squares[lead], 1);              // below 2^33
    const std::int64_t twice = square_root(static_cast<std::uint64_t>(square) << 30);  // twice the largest component, Q30
    const Quotients quotients(2 * twice);
    const auto part = [&](std::size_t n) { return quotients.of(rows[lead][n]); };
    return {part(0), part(1), part(2), part(3)};
}

Quaternion with_sign_of(const Quaternion& q, const Quaternion& last) {
    const auto product = [](Unit a, Unit b) {
        return (std::int64_t{a.raw()} * b.raw()) >> 2;
    };  // the sum of four products then fits into 64 bits
    const std::int64_t dot = product(q.w, last.w) + product(q.x, last.x) + product(q.y, last.y) + product(q.z, last.z);
    return dot < 0 ? Quaternion{-q.w, -q.x, -q.y, -q.z} : q;
}

}  // namespace tricoil::fixed
