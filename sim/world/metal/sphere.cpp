#include "sim/world/metal/sphere.hpp"

#include <cmath>

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;
constexpr double kTruncation = 1e-9;  // of the first term of the series

/// v_n = z i_(n+1)(z) / i_n(z), with the modified spherical Bessel functions of the first kind: 0 for small z.
/// v_n = z^2 / (2 n + 3 + v_(n+1)). This recurrence is stable for falling n; for rising n it is stable while n < |z|.
Complex bessel_ratio(int n, Complex z) {
    constexpr double kUpwards = 60;  // beyond it, coth z = 1
    if (std::abs(z) > kUpwards) {
        Complex v = z - 1.0;  // v_0 = z coth z - 1
        for (int m = 0; m < n; ++m) {
            v = z * z / v - (2 * m + 3.0);
        }
        return v;
    }
    Complex v = 0;
    for (int m = n + 30 + 2 * static_cast<int>(std::abs(z)); m >= n; --m) {
        v = z * z / (2 * m + 3.0 + v);
    }
    return v;
}

/// First and second derivatives of Legendre polynomials of rising order.
struct Legendre {
    explicit Legendre(double argument) : x(argument) {}

    /// From order n to n + 1: P_(n+1)' = (n+1) P_n + x P_n', and P_(n+1)'' = (n+2) P_n' + x P_n''.
    void advance() {
        const double next = ((2 * order + 1) * x * value - order * before) / (order + 1);
        second = (order + 2) * first + x * second;
        first = (order + 1) * value + x * first;
        before = value;
        value = next;
        ++order;
    }

    double x;
    int order = 0;
    double value = 1;
    double before = 0;
    double first = 0;
    double second = 0;
};

}  // namespace

Complex sphere_coefficient(int n, Complex z, double permeability) {
    // Tangential H and radial B are continuous; inside, the field has the radial function i_n(k r). With
    // L = d(r i_n)/dr / i_n at r = a: A = n (L - (n+1) mu) / ((n+1) (n mu + L)), and L = n + 1 + v_n.
    const Complex v = bessel_ratio(n, z);
    return static_cast<double>(n) * (v - (n + 1.0) * (permeability - 1)) / ((n + 1.0) * (n * permeability + n + 1.0 + v));
}

Complex sphere_polarisability(const Sphere& sphere, const Material& material, double hz) {
    const double a = sphere.radius_m;
    return -a * a * a * sphere_coefficient(1, propagation_constant(material, hz) * a, material.permeability(hz));
}

void SphereBody::do_tune(const std::vector<double>& frequencies_hz) {
    coefficients_.resize(frequencies_hz.size());
    for (std::size_t k = 0; k < frequencies_hz.size(); ++k) {
        const Complex z = propagation_constant(material_, frequencies_hz[k]) * sphere_.radius_m;
        for (int n = 1; n <= kOrders; ++n) {
            coefficients_[k][static_cast<std::size_t>(n - 1)] =
                sphere_coefficient(n, z, material_.permeability(frequencies_hz[k]));
        }
    }
}

void SphereBody::do_add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const {
    // A unit charge at l gives the potential sum of r^n / d^(n+1) P_n(cos) and the response
    // F = sum of A_n a^(2n+1) / (d s)^(n+1) P_n(x), x = cosine between l and s. A dipole at l gives the field -grad_s grad_l F.
    const double d = source_m_.norm();
    const double s = sensor_m.norm();
    const Vec3<double> l = source_m_ / d;
    const Vec3<double> r = sensor_m / s;
    const double ratio = sphere_.radius_m * sphere_.radius_m / (d * s);
    const Mat3<double> rl = r * l.transpose();
    const Mat3<double> sides = r * r.transpose() + l * l.transpose();
    Legendre p(l.dot(r));
    Legendre next(p.x);
    p.advance();
    next.advance();
    next.advance();
    double scale = std::pow(sphere_.radius_m / (d * s), 3);  // a^(2n+1) / (d s)^(n+2)
    for (int n = 1; n <= kOrders; ++n) {
        const double onwards = (n + 1) * next.first + p.x * next.second;
        const Mat3<double> term =
            scale * (p.first * Mat3<double>::Identity() + p.second * rl.transpose() - next.second * sides + onwards * rl);
        for (std::size_t k = 0; k < fields.size(); ++k) {
            fields[k] -= coefficients_[k][static_cast<std::size_t>(n - 1)] * term.cast<Complex>();
        }
        scale *= ratio;
        if (std::pow(ratio, n) * n * n * n < kTruncation) {
            break;
        }
        p.advance();
        next.advance();
    }
}

}  // namespace tricoil::sim
