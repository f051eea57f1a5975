// Natural cubic spline through points of fixed dimension: twice continuously differentiable, so that the acceleration is
// continuous.
#pragma once

#include <algorithm>
#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::sim {

template <int Dimension>
class CubicSpline {
public:
    using Point = Matrix<double, Dimension, 1>;
    using Points = std::vector<Point>;

    CubicSpline() = default;

    /// At least two points at strictly increasing times (s).
    CubicSpline(std::vector<double> times, Points points) : times_(std::move(times)), points_(std::move(points)) {
        solve_second_derivatives();
    }

    [[nodiscard]] double begin_s() const { return times_.front(); }
    [[nodiscard]] double end_s() const { return times_.back(); }

    /// Value at `time_s`; outside the range, the value at the nearest end.
    [[nodiscard]] Point at(double time_s) const {
        const double t = std::clamp(time_s, times_.front(), times_.back());
        const std::size_t i = interval(t);
        const double h = times_[i + 1] - times_[i];
        const double b = (t - times_[i]) / h;
        const double a = 1 - b;
        return a * points_[i] + b * points_[i + 1] +
               (h * h / 6) * ((a * a * a - a) * seconds_[i] + (b * b * b - b) * seconds_[i + 1]);
    }

private:
    [[nodiscard]] std::size_t interval(double t) const {
        // The first guess is exact for uniform times; otherwise a linear search starts there.
        const double share = (t - times_.front()) / (times_.back() - times_.front());
        auto i = std::min(static_cast<std::size_t>(share * static_cast<double>(times_.size() - 1)), times_.size() - 2);
        while (i > 0 && t < times_[i]) {
            --i;
        }
        while (i + 2 < times_.size() && t > times_[i + 1]) {
            ++i;
        }
        return i;
    }

    /// Thomas's algorithm on the tridiagonal system of the interior knots; zero curvature at both ends.
    void solve_second_derivatives() {
        const std::size_t n = times_.size();
        seconds_.assign(n, Point::Zero());
        std::vector<double> upper(n, 0.0);
        for (std::size_t i = 1; i + 1 < n; ++i) {
            const double before = times_[i] - times_[i - 1];
            const double after = times_[i + 1] - times_[i];
            const Point slope_change = (points_[i + 1] - points_[i]) / after - (points_[i] - points_[i - 1]) / before;
            const double pivot = 2 * (before + after) - before * upper[i - 1];
            upper[i] = after / pivot;
            seconds_[i] = (6 * slope_change - before * seconds_[i - 1]) / pivot;
        }
        for (std::size_t i = n - 1; i-- > 1;) {
            seconds_[i] -= upper[i] * seconds_[i + 1];
        }
    }

    std::vector<double> times_;
    Points points_;
    Points seconds_;
};

}  // namespace tricoil::sim
