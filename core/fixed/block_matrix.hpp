// Block normalisation: nine couplings that share one exponent, whatever the range.
#pragma once

#include "core/fixed/functions.hpp"
#include "core/fixed/matrix.hpp"
#include "core/fixed/scaled.hpp"

namespace tricoil::fixed {

/// A signal matrix: mantissa 2^exponent, in coupling units. Any mantissas are allowed; codes of a converter serve as they are.
struct BlockMatrix {
    Mat3<std::int32_t> mantissa = Mat3<std::int32_t>::Zero();
    int exponent = 0;
};

/// Entries of a normalised block: at most one in size, the largest at least a half. 28 bits behind the point leave room for what
/// is formed from them: singular values up to 3, sums of two up to 6.
using Entry = Fixed<28>;

struct NormalisedBlock {
    Mat3<Entry> y;  // x = y 2^exponent
    int exponent = 0;
    bool zero = true;  // nothing to normalise
};

/// Rounds to nearest where mantissas are longer than 28 bits: an error of at most 2^-29 of the largest entry's power of two.
NormalisedBlock normalise(const BlockMatrix& x);

/// The unit vector along v; zero for zero. Error per entry below 2^-28 if the largest entry is at least 2^26 in size.
Vec3<Unit> unit_vector(const Vec3<std::int64_t>& v);

/// Two unit vectors that complete x to a right-handed triad, as columns: geometry::transverse_axes in fixed point.
Eigen::Matrix<Unit, 3, 2> transverse_axes(const Vec3<Unit>& x);

/// numerator / denominator in Q30, saturating; denominator >= 0. By zero: the end of the range, by the numerator's sign; 0 / 0 is
/// 0.
Unit ratio(std::int64_t numerator, std::int64_t denominator);

}  // namespace tricoil::fixed
