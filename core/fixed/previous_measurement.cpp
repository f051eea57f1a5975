#include "core/fixed/previous_measurement.hpp"

namespace tricoil::fixed {
namespace {

constexpr Status kTooFar{StatusCode::not_converged, "previous pose is too far from the measurement to linearise about"};
constexpr Entry kMinStrength = Entry::from(1.0 / 16);
constexpr Fixed<31> kThird = Fixed<31>::from(1.0 / 3);

/// True if the length is one within 1/64. The stated ranges assume this.
bool is_unit(const Vec3<Unit>& v) {
    static constexpr Unit kLongest = Unit::from(1 + 1.0 / 64);
    if (!v.all([](Unit entry) { return abs(entry) <= kLongest; })) {
        return false;
    }
    const std::int64_t off = exact_dot(v, v) - (std::int64_t{1} << 60);
    return off < (std::int64_t{1} << 55) && off > -(std::int64_t{1} << 55);
}

/// True if rows have unit length, the first two are orthogonal, and the third is their cross product, each within 1/32.
bool is_rotation(const Mat3<Unit>& o) {
    const Unit tolerance = Unit::from(1.0 / 32);
    if (!is_unit(o.row(0)) || !is_unit(o.row(1)) || !is_unit(o.row(2)) || abs(dot<30>(o.row(0), o.row(1))) > tolerance) {
        return false;
    }
    const Vec3<Unit> off = cross<30>(o.row(0), o.row(1)) - Vec3<Unit>(o.row(2));
    return off.all([tolerance](Unit entry) { return abs(entry) <= tolerance; });
}

/// Increments of (15) and (16): strength in units of the block, the rest in radians, each at most one.
struct Increments {
    Entry strength;
    Unit azimuth, elevation, roll, pitch, yaw;
};

/// Entries of w are at most 3 (a rotated Y), sums of three at most 9: computed in 64 bits, then divided by W11.
Result<Increments> increments_of(const Mat3<Entry>& w) {
    const Entry k = w(0, 0);
    if (k < kMinStrength) {
        return kTooFar;
    }
    const Quotients quotients(k.raw());
    const auto over_k = [&quotients](std::int64_t numerator) { return quotients.of(numerator); };
    const auto entry = [&w](Index i, Index j) { return std::int64_t{w(i, j).raw()}; };
    const auto two_thirds = [](std::int64_t value) { return shift_right_rounded(value * kThird.raw(), 30); };
    const Increments step{k,
                          over_k(two_thirds(2 * entry(0, 1) - entry(1, 0))),
                          over_k(two_thirds(entry(2, 0) - 2 * entry(0, 2))),
                          over_k(entry(2, 1) - entry(1, 2)),
                          over_k(2 * (entry(2, 0) - entry(0, 2))),
                          over_k(2 * (entry(0, 1) - entry(1, 0)))};
    for (const Unit value : {step.azimuth, step.elevation, step.roll, step.pitch, step.yaw}) {
        if (abs(value) > Unit(1)) {
            return kTooFar;
        }
    }
    return step;
}

/// Active rotation by -r, |r_i| <= 1: I - a [r]x + b [r]x^2 with a = sin(|r|) / |r|, b = (1 - cos(|r|)) / |r|^2. Both are series
/// in |r|^2 <= 3 whose first omitted term is below 1e-6 at 3 and below 1e-11 at 0.3.
Mat3<Unit> rotation_back(const Vec3<Unit>& r) {
    using Square = Fixed<29>;
    const Square x = dot<29>(r, r);  // at most 3
    const auto series = [x](const Square(&c)[6]) {
        Square sum = c[5];
        for (int n = 4; n >= 0; --n) {
            sum = c[n] + sum * x;
        }
        return sum;
    };
    static constexpr Square kSineOver[6] = {Square::from(1.0),         Square::from(-1.0 / 6),     Square::from(1.0 / 120),
                                            Square::from(-1.0 / 5040), Square::from(1.0 / 362880), Square::from(-1.0 / 39916800)};
    static constexpr Square kVersine[6] = {Square::from(0.5),           Square::from(-1.0 / 24),
                                           Square::from(1.0 / 720),     Square::from(-1.0 / 40320),
                                           Square::from(1.0 / 3628800), Square::from(-1.0 / 479001600)};
    const Square a = series(kSineOver);
    const Square b = series(kVersine);
    const Vec3<Unit> ar(product<30>(a, r.x()), product<30>(a, r.y()), product<30>(a, r.z()));
    // [r]x^2 = r r^T - |r|^2 I
    Mat3<Unit> rotation;
    for (Index i = 0; i < 3; ++i) {
        for (Index j = 0; j < 3; ++j) {
            rotation(i, j) = product<30>(b, r(i) * r(j));
        }
    }
    const Unit diagonal = Unit(1) - product<30>(b, x);
    rotation(0, 0) += diagonal;
    rotation(1, 1) += diagonal;
    rotation(2, 2) += diagonal;
    rotation(0, 1) += ar.z();
    rotation(1, 0) -= ar.z();
    rotation(0, 2) -= ar.y();
    rotation(2, 0) += ar.y();
    rotation(1, 2) += ar.x();
    rotation(2, 1) -= ar.x();
    return rotation;
}

/// One step of O <- O (3 I - O^T O) / 2 towards the nearest rotation. Its error is of second order in the rounding errors.
Mat3<Unit> orthonormalised(const Mat3<Unit>& o) {
    const Mat3<Unit> gram = multiply<30>(o.transpose(), o);
    Mat3<Unit> correction;
    for (Index i = 0; i < 9; ++i) {
        const std::int64_t identity = i % 4 == 0 ? std::int64_t{3} << 30 : 0;
        correction(i) = Unit::from_raw(saturate(shift_right_rounded(identity - gram(i).raw(), 1)));
    }
    return multiply<30>(o, correction);
}

VectorPose turn(const VectorPose& previous, const Mat3<Unit>& p, const Increments& step) {
    const Mat3<Unit> back = p.transpose();
    const Vec3<Unit> across = multiply<30>(back, Vec3<Unit>(0, step.azimuth, -step.elevation));
    const Vec3<Unit> rotation = multiply<30>(back, Vec3<Unit>(step.roll, step.pitch, step.yaw));
    VectorPose next = previous;
    Vec3<std::int64_t> direction;
    for (Index i = 0; i < 3; ++i) {
        direction(i) = std::int64_t{previous.direction(i).raw()} + across(i).raw();
    }
    next.direction = unit_vector(direction);
    next.attitude = orthonormalised(multiply<30>(previous.attitude, rotation_back(rotation)));
    return next;
}

}  // namespace

Result<VectorPose> step_vectors(const BlockMatrix& x, Scaled coupling_constant, const VectorPose& previous, int passes) {
    if (coupling_constant.mantissa <= 0) {
        return Status{StatusCode::invalid_argument, "coupling constant must be positive"};
    }
    if (passes < 1 || passes > kMaxPasses) {
        return Status{StatusCode::invalid_argument, "passes must be 1 to 10"};
    }
    if (!is_unit(previous.direction) || !is_rotation(previous.attitude)) {
        return Status{StatusCode::invalid_argument, "previous pose must consist of a unit vector and a rotation"};
    }
    const NormalisedBlock block = normalise(x);
    if (block.zero) {
        return Status{StatusCode::degenerate, "signal matrix is zero: no field at the sensor"};
    }
    VectorPose pose = previous;
    Entry strength;
    for (int pass = 0; pass < passes; ++pass) {
        Mat3<Unit> p;
        p << pose.direction.transpose(), transverse_axes(pose.direction).transpose();
        const Mat3<Entry> turned = multiply<28>(multiply<28>(p, multiply<28>(pose.attitude.transpose(), block.y)), p.transpose());
        const auto step = increments_of(turned);
        if (!step.ok()) {
            return step.status();
        }
        pose = turn(pose, p, *step);
        strength = step->strength;
    }
    const Scaled k = normalise(strength.raw(), block.exponent - Entry::kFractionBits);
    pose.range_m = to_fixed<28>(cube_root(divide(coupling_constant, k)));
    return pose;
}

}  // namespace tricoil::fixed
