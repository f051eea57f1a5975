// Motions that a test can define in one line.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "sim/motion/motion.hpp"

namespace tricoil::test {

/// Position as a function of time, constant attitude.
class Path final : public sim::Motion {
public:
    explicit Path(std::function<Vec3<double>(double)> place) : place_(std::move(place)) {}

private:
    [[nodiscard]] sim::Pose do_at(double t) const override { return {place_(t), Quat<double>::Identity()}; }
    std::function<Vec3<double>(double)> place_;
};

/// Smooth motion from one position to another between two times; at rest before and after.
inline Path moved(const Vec3<double>& from, const Vec3<double>& to, double begin_s, double end_s) {
    return Path([=](double t) -> Vec3<double> {
        const double s = std::clamp((t - begin_s) / (end_s - begin_s), 0.0, 1.0);
        return from + s * s * (3 - 2 * s) * (to - from);
    });
}

/// Half a circle around the source in the first second, from +x to -x at 0.5 m; then at rest.
inline Path walked_behind() {
    return Path([](double t) -> Vec3<double> {
        const double angle = std::min(t, 1.0) * std::numbers::pi;
        return 0.5 * Vec3<double>(std::cos(angle), std::sin(angle), 0.1);
    });
}

}  // namespace tricoil::test
