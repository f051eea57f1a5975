// Couplings in two bands of a moving sensor near a moving conducting sphere.
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "core/field/general_dipole.hpp"
#include "core/geometry/rotations.hpp"
#include "core/solver/refine.hpp"

namespace tricoil::test {

inline constexpr double kDualBandCoupling = 6.75e-3;  // m^3, as in the simulation

struct Sphere {
    double radius_m;
    double conductivity_s_m;
    double relative_permeability;
};

/// Magnetic polarisability over 4 pi, m^3: moment = 4 pi alpha H (Wait 1951).
inline std::complex<double> polarisability(const Sphere& s, double frequency_hz) {
    constexpr double kMu0 = 4e-7 * std::numbers::pi;
    const double mu = s.relative_permeability;
    const std::complex<double> z =
        s.radius_m * std::sqrt(std::complex<double>(0, 2 * std::numbers::pi * frequency_hz * kMu0 * mu * s.conductivity_s_m));
    const std::complex<double> t = z / std::tanh(z);
    const double cubed = s.radius_m * s.radius_m * s.radius_m;
    return cubed / 2 * (2 * mu * (t - 1.0) - (z * z + 1.0 - t)) / (mu * (t - 1.0) + (z * z + 1.0 - t));
}

inline const Sphere kSteel304{0.02, 1.39e6, 1.02};

struct TwoBandScene {
    unsigned seed = 1;
    double rate_hz = 1500;
    std::size_t ratio = 32;  // high-band lines for each low-band line
    double duration_s = 12;
    double metal_from_s = 3;
    Sphere sphere = kSteel304;
    double high_hz = 10500;
    double low_hz = 300;
    double high_noise = 3e-6;  // relative to the norm of the couplings
    double low_noise = 1e-5;
};

struct TwoBandData {
    field::GeneralDipole<double> high_model;
    field::GeneralDipole<double> low_model;
    std::vector<Mat3<double>> high;
    std::vector<Mat3<double>> low;  // line k: mean over the 2 * ratio high-band lines before line k * ratio
    std::vector<solver::RigidPose<double>> truth;
    double share = 0;  // effect of the sphere in the low band relative to the high band
};

namespace two_bands_detail {

/// Each component is the sum of two sines with random phases and frequencies in the given range.
class SmoothPath {
public:
    SmoothPath(std::mt19937& random, double amplitude, double least_hz, double most_hz) : amplitude_(amplitude) {
        std::uniform_real_distribution<double> hz(least_hz, most_hz);
        std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
        for (int i = 0; i < 6; ++i) {
            hz_[i] = hz(random);
            phase_[i] = phase(random);
        }
    }
    [[nodiscard]] Vec3<double> at(double t_s) const {
        Vec3<double> v;
        for (int i = 0; i < 3; ++i) {
            const auto sine = [&](int k) { return std::sin(2 * std::numbers::pi * hz_[k] * t_s + phase_[k]); };
            v(i) = amplitude_ * (sine(i) + sine(i + 3) / 1.5);
        }
        return v;
    }

private:
    double amplitude_;
    double hz_[6]{};
    double phase_[6]{};
};

inline Mat3<double> dipole(const Vec3<double>& r) {
    const double length = r.norm();
    const Vec3<double> u = r / length;
    return (3 * u * u.transpose() - Mat3<double>::Identity()) / (length * length * length);
}

/// Couplings through a sphere of unit polarisability at `centre`.
inline Mat3<double> through_sphere(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose,
                                   const Vec3<double>& centre) {
    const Mat3<double> turn = pose.q_source_sensor.toRotationMatrix();
    Mat3<double> x;
    for (int j = 0; j < 3; ++j) {
        const Vec3<double> field = dipole(centre - model.source_offset_m.col(j)) * model.source_moment.col(j) / 2;
        for (int i = 0; i < 3; ++i) {
            const Vec3<double> coil = pose.position_m + turn * model.sensor_offset_m.col(i);
            x(i, j) = (turn * model.sensor_sensitivity.col(i)).dot(dipole(coil - centre) * field);
        }
    }
    return x;
}

inline void keep_away(Vec3<double>& point, const Vec3<double>& from, double least_m) {
    const Vec3<double> d = point - from;
    if (d.norm() < least_m) {
        point = from + d.normalized() * least_m;
    }
}

}  // namespace two_bands_detail

inline TwoBandData two_bands(const TwoBandScene& scene) {
    using namespace two_bands_detail;
    std::mt19937 random(scene.seed);
    std::normal_distribution<double> normal;
    const auto noise = [&](double sigma) -> Mat3<double> {
        return sigma * Mat3<double>::NullaryExpr([&] { return normal(random); });
    };
    TwoBandData data;
    data.high_model.source_offset_m << 0.045, 0, 0, 0, 0.045, 0, -0.044, -0.043, 0;
    data.low_model = data.high_model;
    data.low_model.source_moment *= 0.03;
    const std::complex<double> high_effect = polarisability(scene.sphere, scene.high_hz);
    data.share = polarisability(scene.sphere, scene.low_hz).real() / high_effect.real();
    const SmoothPath hand(random, 0.05, 0.2, 1.1);
    const SmoothPath wrist(random, 0.25, 0.2, 1.1);
    const SmoothPath metal(random, 0.06, 0.15, 0.45);
    const auto rows = static_cast<std::size_t>(scene.duration_s * scene.rate_hz);
    std::vector<Mat3<double>> low{Mat3<double>::Zero()};  // running sum
    for (std::size_t n = 0; n < rows; ++n) {
        const double t = static_cast<double>(n) / scene.rate_hz;
        solver::RigidPose<double> pose;
        pose.position_m = Vec3<double>(0.3, 0.1, 0.08) + hand.at(t);
        pose.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(wrist.at(t)) *
                               geometry::rotation_vector_to_quaternion<double>(Vec3<double>(0.3, -0.5, 0.7));
        Vec3<double> centre = Vec3<double>(0.22, -0.1, 0.1) + metal.at(t);
        keep_away(centre, Vec3<double>::Zero(), scene.sphere.radius_m + 0.08);
        keep_away(centre, pose.position_m, scene.sphere.radius_m + 0.05);
        const double arrives = 1 / (1 + std::exp(-(t - scene.metal_from_s) / 0.15));
        const Mat3<double> clean =
            field::signal_matrix<double>(data.high_model, pose.position_m, pose.q_source_sensor.conjugate().toRotationMatrix());
        const Mat3<double> effect = arrives * high_effect.real() * through_sphere(data.high_model, pose, centre);
        data.high.push_back(clean + effect + noise(scene.high_noise * clean.norm()));
        low.push_back(low.back() + 0.03 * (clean + data.share * effect));
        data.truth.push_back(pose);
    }
    for (std::size_t end = 0; end < rows; end += scene.ratio) {
        const std::size_t begin = end < 2 * scene.ratio ? 0 : end - 2 * scene.ratio;
        const Mat3<double> mean = end == 0 ? low[1] : Mat3<double>((low[end] - low[begin]) / static_cast<double>(end - begin));
        data.low.push_back(mean + noise(scene.low_noise * mean.norm()));
    }
    return data;
}

}  // namespace tricoil::test
