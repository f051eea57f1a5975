// Motions defined by formulas: still, line, circle, a tilting tool, rests on a grid, the paper's rates, and a random hand motion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/geometry/angles.hpp"
#include "sim/motion/motion.hpp"

namespace tricoil::sim {

class StillMotion final : public Motion {
public:
    explicit StillMotion(const Pose& pose) : pose_(pose) {}

private:
    [[nodiscard]] Pose do_at(double) const override { return pose_; }
    Pose pose_;
};

/// Sinusoidal motion along a line with fixed attitude.
class LineMotion final : public Motion {
public:
    /// centre_m +- amplitude_m, at `rate_hz`.
    LineMotion(const Pose& centre, const Vec3<double>& amplitude_m, double rate_hz);

private:
    [[nodiscard]] Pose do_at(double time_s) const override;
    Pose centre_;
    Vec3<double> amplitude_m_;
    double rate_rad_s_;
};

/// A circle in a plane of constant z; the sensor turns about z at the same rate.
class CircleMotion final : public Motion {
public:
    CircleMotion(const Vec3<double>& centre_m, double radius_m, double rate_hz);

private:
    [[nodiscard]] Pose do_at(double time_s) const override;
    Vec3<double> centre_m_;
    double radius_m_;
    double rate_rad_s_;
};

/// A tool whose tip rests at a fixed point while the tool tilts: the rotation vector (sensor frame) from the mean attitude is a
/// Lissajous figure.
struct PivotParams {
    Vec3<double> pivot_m{0.6, 0, 0};
    Quat<double> q_mean = Quat<double>::Identity();  // v_source = q v_sensor
    Vec3<double> tip_m{0.15, 0, 0};                  // sensor frame
    Vec3<double> tilt_rad{0.5, 0.5, 0.5};            // amplitudes about the sensor's axes
    double rate_hz = 0.2;
};
class PivotMotion final : public Motion {
public:
    explicit PivotMotion(const PivotParams& params) : params_(params) {}

private:
    [[nodiscard]] Pose do_at(double time_s) const override;
    PivotParams params_;
};

/// A sensor that rests at the nodes of a grid in turn, several times at each node, each time in another random attitude. It jumps
/// from one pose to the next.
struct GridParams {
    Vec3<double> centre_m{0.5, 0, 0};
    Vec3<double> spacing_m{0.1, 0.1, 0.1};
    std::array<int, 3> nodes{3, 3, 3};  // along x, y, z
    int attitudes = 1;                  // at each node
    double rest_s = 0.1;                // in each pose

    [[nodiscard]] std::size_t poses() const {
        return static_cast<std::size_t>(nodes[0]) * static_cast<std::size_t>(nodes[1]) * static_cast<std::size_t>(nodes[2]) *
               static_cast<std::size_t>(attitudes);
    }
};
class GridMotion final : public Motion {
public:
    GridMotion(const GridParams& params, std::uint64_t seed);

private:
    [[nodiscard]] Pose do_at(double time_s) const override;
    GridParams params_;
    std::vector<Quat<double>> attitudes_;  // by pose
};

/// The paper's motions, (40) and (41), integrated exactly: alpha' = B + A sin(A t), beta' likewise, rho' = 0.3 + 0.2 sin(10 pi
/// t), psi' = theta' = phi' = W sin(W t).
struct PaperRates {
    double azimuth_amplitude = 0;    // A_alpha, rad/s
    double azimuth_offset = 0;       // B_alpha, rad/s
    double elevation_amplitude = 0;  // A_beta, rad/s
    double elevation_offset = 0;     // B_beta, rad/s
    double attitude_amplitude = 0;   // W, rad/s
    double start_range_m = 0.5;
};
class PaperMotion final : public Motion {
public:
    explicit PaperMotion(const PaperRates& rates) : rates_(rates) {}

private:
    [[nodiscard]] Pose do_at(double time_s) const override;
    PaperRates rates_;
};

/// A seeded sum of sines that resembles a fast hand motion: band 0.2 to 2.5 Hz, peak speed about 2 m/s, 0.2 m around its centre.
class HandMotion final : public Motion {
public:
    HandMotion(const Vec3<double>& centre_m, std::uint64_t seed);

private:
    static constexpr std::size_t kSines = 5;
    struct Sine {
        Vec3<double> amplitude;
        Vec3<double> phase_rad;
        double rate_rad_s;
    };
    [[nodiscard]] Pose do_at(double time_s) const override;
    Vec3<double> centre_m_;
    std::array<Sine, kSines> position_{};
    std::array<Sine, kSines> rotation_{};
};

/// Another motion `speed` times as fast.
class PacedMotion final : public Motion {
public:
    PacedMotion(std::unique_ptr<Motion> motion, double speed) : motion_(std::move(motion)), speed_(speed) {}

private:
    [[nodiscard]] Pose do_at(double time_s) const override { return motion_->at(speed_ * time_s); }
    std::unique_ptr<Motion> motion_;
    double speed_;
};

}  // namespace tricoil::sim
