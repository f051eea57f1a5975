#include "sim/world/metal/cylinder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;
constexpr double kOpaque = 30;  // skin depths; the field behind such a wall is 1e-13

/// u_m = z I_(m+1)(z) / I_m(z) with the modified Bessel functions, for m = 0 and 1; u_m = z^2 / (2 (m + 1) + u_(m+1)).
std::array<Complex, 2> bessel_ratios(Complex z) {
    constexpr double kAsymptotic = 100;
    if (std::abs(z) > kAsymptotic) {
        const Complex first = z - 0.5 - 1.0 / (8.0 * z) - 1.0 / (8.0 * z * z);  // Abramowitz and Stegun 9.7.1
        return {first, z * z / first - 2.0};
    }
    Complex u = 0;
    for (int m = 30 + 2 * static_cast<int>(std::abs(z)); m > 1; --m) {
        u = z * z / (2 * (m + 1.0) + u);
    }
    const Complex second = z * z / (4.0 + u);
    return {z * z / (2.0 + second), second};
}

/// Logarithmic derivative w = r f'/f at the outer radius of a solution of f'' + f'/r = (k^2 + order^2 / r^2) f inside a wall; `w`
/// at the inner radius. In layers of equal log r, with s^2 = k^2 r^2 + order^2 replaced by its mean: f = cosh and sinh of s log
/// r.
Complex through_wall(Complex k, int order, Complex w, double inner_m, double outer_m) {
    const int layers = 800 + static_cast<int>(200 * std::abs(k) * (outer_m - inner_m));
    const double h = std::log(outer_m / inner_m) / layers;
    const double growth = std::exp(2 * h);
    double squared = inner_m * inner_m;
    for (int i = 0; i < layers; ++i) {
        const Complex s = std::sqrt(static_cast<double>(order) + k * k * squared * ((growth - 1) / (2 * h)));
        const Complex t = std::tanh(s * h);
        w = s * (w + s * t) / (s + w * t);
        squared *= growth;
    }
    return w;
}

/// Complete elliptic integral K of parameter m by the arithmetic-geometric mean.
double elliptic_k(double m) {
    double a = 1;
    double b = std::sqrt(1 - m);
    while (std::abs(a - b) > 1e-12 * a) {
        const double mean = (a + b) / 2;
        b = std::sqrt(a * b);
        a = mean;
    }
    return std::numbers::pi / (2 * a);
}

/// Mean of 1 / distance between a ring of radius b and a point of an equal ring, `z` apart along the axis.
double ring_potential(double b, double z) {
    const double longest = z * z + 4 * b * b;
    return 2 / std::numbers::pi * elliptic_k(4 * b * b / longest) / std::sqrt(longest);
}

/// As ring_potential(), with the ring spread over a band that reaches from `from` to `to` along the axis.
double band_potential(double b, double from, double to) {
    constexpr int kPoints = 12;
    double sum = 0;
    for (int i = 0; i < kPoints; ++i) {
        const double z = from + (i + 0.5) * (to - from) / kPoints;
        sum += ring_potential(b, z);
    }
    return sum / kPoints;
}

int piece_count(const Cylinder& c) { return static_cast<int>(std::clamp(4 * c.length_m / c.diameter_m, 16.0, 60.0)); }

}  // namespace

CylinderResponse cylinder_response(const Cylinder& cylinder, const Material& material, double hz) {
    // Across: outside A_z = mu0 H (r + across b^2 / r) sin phi, inside f(r) sin phi with q = b f'/f; A_z and H_phi continuous.
    // Along: flux = mu0 pi b^2 (1 + along) H, from the electric field -H'/sigma at the surface.
    const double mu = material.permeability(hz);
    const Complex k = propagation_constant(material, hz);
    const double b = cylinder.diameter_m / 2;
    const double c = cylinder.wall_m > 0 ? b - cylinder.wall_m : 0;
    const Complex z = k * b;
    Complex q;
    Complex w;
    if (c <= 0 || k.real() * (b - c) > kOpaque) {
        const auto [first, second] = bessel_ratios(z);
        q = 1.0 + second;
        w = first;
    } else {
        q = through_wall(k, 1, mu, c, b);
        w = through_wall(k, 0, k * k * c * c / (2 * mu), c, b);
    }
    return {(mu - q) / (mu + q), 2 * mu * w / (z * z) - 1.0};
}

CylinderBody::CylinderBody(const Cylinder& cylinder, const Material& material) : cylinder_(cylinder), material_(material) {
    const int pieces = piece_count(cylinder);
    const double step = cylinder.length_m / pieces;
    const double half = cylinder.length_m / 2;
    for (int i = 0; i <= pieces; ++i) {
        node_m_.push_back(-half + i * step);
        if (i < pieces) {
            piece_m_.push_back(-half + (i + 0.5) * step);
        }
    }
    // Poles are spread over bands of the surface, one step long and half a step at the ends.
    const double b = cylinder.diameter_m / 2;
    potential_.resize(pieces + 1, pieces + 1);
    for (int i = 0; i <= pieces; ++i) {
        for (int j = 0; j <= pieces; ++j) {
            const double from = std::max(-half, -half + (j - 0.5) * step);
            const double to = std::min(half, -half + (j + 0.5) * step);
            const double at = -half + i * step;
            potential_(i, j) = band_potential(b, from - at, to - at);
        }
    }
    potential_ = (potential_ + potential_.transpose()).eval() / 2;  // reciprocity holds exactly
}

void CylinderBody::do_tune(const std::vector<double>& frequencies_hz) {
    const auto nodes = static_cast<Index>(node_m_.size());
    const double b = cylinder_.diameter_m / 2;
    const double step = cylinder_.length_m / static_cast<double>(nodes - 1);
    Eigen::MatrixXd differences = Eigen::MatrixXd::Zero(nodes, nodes);  // second differences along the chain of nodes
    for (Index i = 0; i + 1 < nodes; ++i) {
        differences.block<2, 2>(i, i) += (Eigen::Matrix2d() << 1, -1, -1, 1).finished();
    }
    tones_.clear();
    for (const double hz : frequencies_hz) {
        const CylinderResponse response = cylinder_response(cylinder_, material_, hz);
        // Moment per length between two nodes: pi b^2 along H, H = -difference of the whole potential / step. A pole is the
        // difference of two such moments: q = -(c/4 pi) D (potential0 + P q) with potentials times 4 pi.
        const Complex c = b * b * response.along / (4 * step);
        Eigen::MatrixXcd system = c * (differences * potential_).cast<Complex>();
        system.diagonal().array() += 1.0;
        tones_.push_back({b * b * step / 2 * response.across, -c * solve(system, differences.cast<Complex>())});
    }
}

/// Moves a place that is nearer to an end than one diameter to that distance, because the model has point poles.
Vec3<double> CylinderBody::far_enough(const Vec3<double>& place_m) const {
    const Vec3<double> end(0, 0, std::copysign(cylinder_.length_m / 2, place_m.z()));
    const Vec3<double> r = place_m - end;
    const double distance_m = r.norm();
    if (distance_m >= cylinder_.diameter_m) {
        return place_m;
    }
    const Vec3<double> outwards = distance_m > 0 ? Vec3<double>(r / distance_m) : Vec3<double>(end.normalized());
    return end + cylinder_.diameter_m * outwards;
}

void CylinderBody::do_place_source(const Vec3<double>& place_m) {
    const Vec3<double> source_m = far_enough(place_m);
    const auto nodes = static_cast<Index>(node_m_.size());
    Eigen::MatrixX3d applied(nodes, 3);
    for (Index i = 0; i < nodes; ++i) {
        const Vec3<double> r = Vec3<double>(0, 0, node_m_[static_cast<std::size_t>(i)]) - source_m;
        applied.row(i) = eigen(r / std::pow(r.norm(), 3)).transpose();
    }
    fields_.clear();
    for (const double z : piece_m_) {
        Mat3<double> field = unit_dipole_field(Vec3<double>(0, 0, z) - source_m);
        field.row(2).setZero();
        fields_.push_back(field);
    }
    poles_.clear();
    for (const Tone& tone : tones_) {
        poles_.emplace_back(tone.poles_of_potential * applied.cast<Complex>());
    }
}

void CylinderBody::do_add_field(const Vec3<double>& place_m, std::span<ComplexMat3> fields) const {
    const Vec3<double> sensor_m = far_enough(place_m);
    Mat3<double> across = Mat3<double>::Zero();
    for (std::size_t i = 0; i < piece_m_.size(); ++i) {
        across += unit_dipole_field(sensor_m - Vec3<double>(0, 0, piece_m_[i])) * fields_[i];
    }
    for (std::size_t k = 0; k < fields.size(); ++k) {
        fields[k] += tones_[k].across * across.cast<Complex>();
    }
    for (std::size_t i = 0; i < node_m_.size(); ++i) {
        const Vec3<double> r = sensor_m - Vec3<double>(0, 0, node_m_[i]);
        const Vec3<double> per_pole = r / std::pow(r.norm(), 3);
        for (std::size_t k = 0; k < fields.size(); ++k) {
            fields[k] += ComplexMat3(eigen(per_pole).cast<Complex>() * poles_[k].row(static_cast<Index>(i)));
        }
    }
}

}  // namespace tricoil::sim
