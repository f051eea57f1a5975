// Block normalisation: nine couplings with one common exponent, at any range.
#pragma once

#include "core/fixed/functions.hpp"
#include "core/fixed/matrix.hpp"
#include "core/fixed/scaled.hpp"

namespace tricoil::fixed {

/// Signal matrix mantissa * 2^exponent, coupling units. All mantissas are allowed, also raw converter codes.
struct BlockMatrix {
    Mat3<std::int32_t> mantissa = Mat3<std::int32_t>::Zero();
    int exponent = 0;
};

/// Entry of a normalised block: magnitude at most one, largest entry at least one half. 28 fraction bits leave room for
/// intermediate values: singular values up to 3, sums of two up to 6.
using Entry = Fixed<28>;

struct NormalisedBlock {
    Mat3<Entry> y;  // x = y 2^exponent
    int exponent = 0;
    bool zero = true;  // all entries are zero
};

/// Mantissas longer than 28 bits are rounded to nearest: the error of an entry of y is at most 2^-29.
NormalisedBlock normalise(const BlockMatrix& x);

/// Unit vector along v; zero for zero. Error per entry below 2^-28 if the magnitude of the largest entry is at least 2^26.
Vec3<Unit> unit_vector(const Vec3<std::int64_t>& v);

/// Two unit vectors that complete x to a right-handed triad, as columns: geometry::transverse_axes in fixed point.
Matrix<Unit, 3, 2> transverse_axes(const Vec3<Unit>& x);

/// Quotients with one denominator >= 0, for one division in all. numerator / denominator in Q30, saturating. Division by zero
/// gives the limit with the sign of the numerator; 0 / 0 gives 0.
class Quotients {
public:
    explicit Quotients(std::int64_t denominator);
    [[nodiscard]] Unit of(std::int64_t numerator) const;

private:
    int shift_ = 0;              // to the right, of both numbers, so that the divisor has at most 31 bits
    std::uint32_t divisor_ = 0;  // zero if the denominator is not positive
    int up_ = 0;                 // to the left, so that the divisor has 32 bits
    std::uint32_t inverse_ = 0;  // 2^63 / (divisor 2^up)
};

inline Unit ratio(std::int64_t numerator, std::int64_t denominator) { return Quotients(denominator).of(numerator); }

}  // namespace tricoil::fixed
