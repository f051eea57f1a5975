#include "core/fixed/direct.hpp"

#include <algorithm>
#include <bit>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

/// Positive semidefinite symmetric matrix: xx, xy, xz, yy, yz, zz. Its largest entry is on the diagonal.
template <typename Integer>
struct Symmetric {
    Integer xx, xy, xz, yy, yz, zz;

    [[nodiscard]] Integer trace() const { return xx + yy + zz; }
};

/// Entries of at most 29 bits. The trace is below 3 * 2^29; its square and the sum of squares are below 9 * 2^58.
using Normalised = Symmetric<std::int32_t>;
using Wide = Symmetric<std::int64_t>;

std::int64_t product(std::int32_t a, std::int32_t b) { return std::int64_t{a} * b; }

/// Scales by a power of two such that the largest entry has 29 bits; it must have 29 to 61. The upper half of entry * 2^k is the
/// entry shifted to the right: cheaper than a shift of 64 bits.
Normalised normalise(const Wide& g) {
    const auto largest = static_cast<std::uint64_t>(std::max({g.xx, g.yy, g.zz}));
    const std::uint32_t factor = std::uint32_t{1} << (std::countl_zero(largest) - 3);
    const auto upper = [factor](std::int64_t entry) {
        constexpr std::uint64_t kHalf = std::uint64_t{1} << 31;
        return static_cast<std::int32_t>((static_cast<std::uint64_t>(entry) * factor + kHalf) >> 32);
    };
    return {upper(g.xx), upper(g.xy), upper(g.xz), upper(g.yy), upper(g.yz), upper(g.zz)};
}

Wide squared(const Normalised& g) {
    return {product(g.xx, g.xx) + product(g.xy, g.xy) + product(g.xz, g.xz),
            product(g.xx, g.xy) + product(g.xy, g.yy) + product(g.xz, g.yz),
            product(g.xx, g.xz) + product(g.xy, g.yz) + product(g.xz, g.zz),
            product(g.xy, g.xy) + product(g.yy, g.yy) + product(g.yz, g.yz),
            product(g.xy, g.xz) + product(g.yy, g.yz) + product(g.yz, g.zz),
            product(g.xz, g.xz) + product(g.yz, g.yz) + product(g.zz, g.zz)};
}

constexpr int kMaxSquarings = 10;

/// First right singular vector of y. Each squaring of Y^T Y squares the ratios of its eigenvalues (4 for a dipole). When the
/// largest dominates, every column is a multiple of its eigenvector. Entries of y are at most 1 and one is at least 1/2; entries
/// of Y^T Y are at most 3 * 2^56 units.
Vec3<Unit> first_right_singular_vector(const Mat3<Entry>& y) {
    const auto gram = [&y](Index i, Index j) { return exact_dot(y.col(i), y.col(j)); };
    Normalised g = normalise({gram(0, 0), gram(0, 1), gram(0, 2), gram(1, 1), gram(1, 2), gram(2, 2)});
    for (int n = 0; n < kMaxSquarings; ++n) {
        const Wide square = squared(g);
        // With eigenvalue ratio r << 1, 1 - tr(G^2) / (tr G)^2 is about 2 r or 4 r. After one more squaring r^2 is below 2^-30.
        const std::int64_t whole = product(g.trace(), g.trace());
        const bool single = whole - square.trace() < (whole >> 14);
        g = normalise(square);
        if (single) {
            break;
        }
    }
    if (g.xx >= g.yy && g.xx >= g.zz) {
        return unit_vector({g.xx, g.xy, g.xz});
    }
    return g.yy >= g.zz ? unit_vector({g.xy, g.yy, g.yz}) : unit_vector({g.xz, g.yz, g.zz});
}

/// Q28 from the sum of squares of Q28 numbers; the sum must be below 2^64 units of Q56.
std::int64_t root_q28(std::int64_t squared_q56) { return square_root(static_cast<std::uint64_t>(squared_q56)); }

std::int64_t squared_norm(const Vec3<Entry>& v) { return exact_dot(v, v); }

Vec3<std::int64_t> widened(const Vec3<Entry>& v) { return {v(0).raw(), v(1).raw(), v(2).raw()}; }

/// Plane normal to the first singular vector; the other two singular values may be equal.
/// Entries of ye are at most 3, so b <= 9 * 2^56 units of Q56; in Q27 b is at most 9, root at most 9, sum at most 6.
struct Plane {
    Vec3<Entry> ye1, ye2;
    std::int64_t b11, b22, b12;  // Q27
    Vec3<Fixed<27>> normal;      // ye1 x ye2
    std::int64_t root;           // s2 s3, Q27
    std::int64_t sum;            // s2 + s3, Q28

    Plane(const Mat3<Entry>& y, const Matrix<Unit, 3, 2>& e)
        : ye1(multiply<28>(y, e.col(0))), ye2(multiply<28>(y, e.col(1))), normal(cross<27>(ye1, ye2)) {
        const std::int64_t b11_q56 = squared_norm(ye1);
        const std::int64_t b22_q56 = squared_norm(ye2);
        b11 = shift_right_rounded(b11_q56, 29);
        b22 = shift_right_rounded(b22_q56, 29);
        b12 = shift_right_rounded(exact_dot(ye1, ye2), 29);
        root = square_root(static_cast<std::uint64_t>(exact_dot(normal, normal)));
        sum = root_q28(b11_q56 + b22_q56 + root * (std::int64_t{1} << 30));
    }

    /// Columns of the polar factor: ye [b22 + r, -b12; -b12, b11 + r] / (sum r). Products stay below 3 * 18 * 2 * 2^55 units.
    [[nodiscard]] Matrix<Unit, 3, 2> polar() const {
        const Quotients over(sum * root);  // Q55
        Matrix<Unit, 3, 2> result;
        for (Index i = 0; i < 3; ++i) {
            const std::int64_t first = ye1(i).raw();
            const std::int64_t second = ye2(i).raw();
            result(i, 0) = over.of(first * (b22 + root) - second * b12);
            result(i, 1) = over.of(second * (b11 + root) - first * b12);
        }
        return result;
    }

    /// |s2 - s3| = sqrt((b11 - b22)^2 + 4 b12^2) / sum in Q28; the squares stay below 2^63 units of Q54.
    [[nodiscard]] std::int64_t difference() const {
        const std::int64_t d = b11 - b22;
        const auto squared = static_cast<std::uint64_t>(d * d) + 4 * static_cast<std::uint64_t>(b12 * b12);
        return (std::int64_t{square_root(squared)} * (std::int64_t{1} << 29)) / sum;
    }
};

constexpr std::int64_t kMinRootQ27 = 1 << 15;  // below it s2 s3 has fewer than 12 significant bits

}  // namespace

Result<DirectSolution> solve_direct(const BlockMatrix& x, Scaled coupling_constant) {
    if (coupling_constant.mantissa <= 0) {
        return Status{StatusCode::invalid_argument, "coupling constant must be positive"};
    }
    const NormalisedBlock block = normalise(x);
    if (block.zero) {
        return Status{StatusCode::degenerate, "signal matrix is zero: no field at the sensor"};
    }
    const Vec3<Unit> v1 = first_right_singular_vector(block.y);
    const Matrix<Unit, 3, 2> e = transverse_axes(v1);
    const Plane plane(block.y, e);
    if (plane.root < kMinRootQ27) {
        return Status{StatusCode::degenerate, "signal matrix has rank below three: a coil or a channel is dead"};
    }
    const Vec3<Entry> image = multiply<28>(block.y, v1);
    const std::int64_t s1 = root_q28(squared_norm(image));
    const Vec3<Unit> u1 = unit_vector(widened(image));
    const Matrix<Unit, 3, 2> polar = plane.polar();

    DirectSolution solution;
    solution.strength = normalise((2 * s1 + plane.sum) * (std::int64_t{1} << 31) / 3, block.exponent - 28 - 31);
    solution.range_m = to_fixed<28>(cube_root(divide(coupling_constant, solution.strength)));
    solution.direction = v1;
    for (Index i = 0; i < 3; ++i) {
        for (Index j = 0; j < 3; ++j) {
            // Three products of unit entries: below 3 * 2^60 units.
            const std::int64_t sum = std::int64_t{u1(i).raw()} * v1(j).raw() - std::int64_t{polar(i, 0).raw()} * e(j, 0).raw() -
                                     std::int64_t{polar(i, 1).raw()} * e(j, 1).raw();
            solution.attitude(i, j) = Unit::from_raw(saturate(shift_right_rounded(sum, 30)));
        }
    }
    const std::int64_t off = s1 - plane.sum;             // |off| <= 6
    const std::int64_t difference = plane.difference();  // at most s1, hence 3
    const std::int64_t misfit = off * off / 3 + difference * difference / 2;
    const std::int64_t power = s1 * s1 + squared_norm(plane.ye1) + squared_norm(plane.ye2);
    solution.misfit_share = ratio(misfit, power);
    solution.right_handed = dot<27>(u1, plane.normal).raw() > 0;
    return solution;
}

}  // namespace tricoil::fixed
