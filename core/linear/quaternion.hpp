// Quaternions; those of attitudes have length one.
#pragma once

#include "core/linear/matrix.hpp"

namespace tricoil {

/// A quaternion of another library (see linear/eigen.hpp).
template <typename Q>
concept ForeignQuaternion = requires(const Q& q) {
    q.coeffs().coeff(0);
    q.w();
};

/// w + x i + y j + z k. In memory x, y, z, w. The default constructor leaves it undefined.
template <typename Scalar_>
class Quaternion {
public:
    using Scalar = Scalar_;
    using Vector = Matrix<Scalar, 3, 1>;
    using Rotation = Matrix<Scalar, 3, 3>;

    constexpr Quaternion() = default;
    constexpr Quaternion(Scalar w, Scalar x, Scalar y, Scalar z) : coeffs_(x, y, z, w) {}
    /// x, y, z, w.
    constexpr explicit Quaternion(const Matrix<Scalar, 4, 1>& coeffs) : coeffs_(coeffs) {}
    /// Of a rotation matrix (Shepperd 1978: divides by the largest of four sums).
    explicit Quaternion(const Rotation& m) {
        if (const Scalar trace = m.trace(); trace > 0) {
            const Scalar root = std::sqrt(trace + Scalar(1));
            const Scalar half = Scalar(0.5) / root;
            w() = Scalar(0.5) * root;
            vec() = Vector(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)) * half;
            return;
        }
        int i = m(1, 1) > m(0, 0) ? 1 : 0;
        i = m(2, 2) > m(i, i) ? 2 : i;
        const int j = (i + 1) % 3;
        const int k = (j + 1) % 3;
        const Scalar root = std::sqrt(m(i, i) - m(j, j) - m(k, k) + Scalar(1));
        const Scalar half = Scalar(0.5) / root;
        w() = (m(k, j) - m(j, k)) * half;
        coeffs_(i) = Scalar(0.5) * root;
        coeffs_(j) = (m(j, i) + m(i, j)) * half;
        coeffs_(k) = (m(k, i) + m(i, k)) * half;
    }
    template <ForeignQuaternion Q>
    Quaternion(const Q& q) : Quaternion(q.w(), q.x(), q.y(), q.z()) {}

    static constexpr Quaternion Identity() { return {1, 0, 0, 0}; }

    constexpr Scalar w() const { return coeffs_(3); }
    constexpr Scalar x() const { return coeffs_(0); }
    constexpr Scalar y() const { return coeffs_(1); }
    constexpr Scalar z() const { return coeffs_(2); }
    constexpr Scalar& w() { return coeffs_(3); }
    constexpr Scalar& x() { return coeffs_(0); }
    constexpr Scalar& y() { return coeffs_(1); }
    constexpr Scalar& z() { return coeffs_(2); }
    constexpr auto vec() const { return coeffs_.template head<3>(); }
    constexpr auto vec() { return coeffs_.template head<3>(); }
    constexpr const Matrix<Scalar, 4, 1>& coeffs() const { return coeffs_; }
    constexpr Matrix<Scalar, 4, 1>& coeffs() { return coeffs_; }

    constexpr Quaternion conjugate() const { return {w(), -x(), -y(), -z()}; }
    constexpr Scalar squaredNorm() const { return coeffs_.squaredNorm(); }
    constexpr Scalar norm() const { return coeffs_.norm(); }
    constexpr Scalar dot(const Quaternion& b) const { return coeffs_.dot(b.coeffs_); }
    constexpr Quaternion& setIdentity() { return *this = Identity(); }
    constexpr void normalize() { coeffs_.normalize(); }
    constexpr Quaternion normalized() const { return Quaternion(coeffs_.normalized()); }
    /// Attitude at share t of the shortest rotation from this to b; both have length one (Shoemake 1985).
    Quaternion slerp(Scalar t, const Quaternion& b) const {
        const Scalar cosine = dot(b);
        Scalar from = Scalar(1) - t;
        Scalar to = t;
        if (std::abs(cosine) < Scalar(1) - std::numeric_limits<Scalar>::epsilon()) {
            const Scalar angle = std::acos(std::abs(cosine));
            from = std::sin(from * angle) / std::sin(angle);
            to = std::sin(to * angle) / std::sin(angle);
        }
        return Quaternion(coeffs_ * from + b.coeffs_ * (cosine < 0 ? -to : to));
    }
    template <typename To>
    constexpr Quaternion<To> cast() const {
        return Quaternion<To>(coeffs_.template cast<To>());
    }

    constexpr Quaternion operator*(const Quaternion& b) const {
        return {w() * b.w() - x() * b.x() - y() * b.y() - z() * b.z(), w() * b.x() + x() * b.w() + y() * b.z() - z() * b.y(),
                w() * b.y() + y() * b.w() + z() * b.x() - x() * b.z(), w() * b.z() + z() * b.w() + x() * b.y() - y() * b.x()};
    }
    /// Rotates v; the quaternion has length one.
    constexpr Vector operator*(const Vector& v) const {
        const Vector twice = vec().cross(v) * Scalar(2);
        return v + w() * twice + vec().cross(twice);
    }
    constexpr Rotation toRotationMatrix() const {
        const Scalar tx = 2 * x();
        const Scalar ty = 2 * y();
        const Scalar tz = 2 * z();
        const Scalar twx = tx * w();
        const Scalar twy = ty * w();
        const Scalar twz = tz * w();
        const Scalar txx = tx * x();
        const Scalar txy = ty * x();
        const Scalar txz = tz * x();
        const Scalar tyy = ty * y();
        const Scalar tyz = tz * y();
        const Scalar tzz = tz * z();
        return (Rotation() << 1 - (tyy + tzz), txy - twz, txz + twy,  //
                txy + twz, 1 - (txx + tzz), tyz - twx,                //
                txz - twy, tyz + twx, 1 - (txx + tyy))
            .finished();
    }

private:
    Matrix<Scalar, 4, 1> coeffs_;
};

template <typename Scalar>
using Quat = Quaternion<Scalar>;

}  // namespace tricoil
