// RMS, percentiles and maximum of errors, and which poses count in them.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace tricoil::host {

/// Poses that are compared with true ones: after the settling time, with the true sensor in this range.
constexpr double kScoreSettling_s = 0.5;
constexpr double kNearestScored_m = 0.15;
constexpr double kFarthestScored_m = 2.0;

struct ErrorSummary {
    double rms = 0;
    double median = 0;
    double p95 = 0;
    double max = 0;
};

/// Of a series that is not empty; the upper one of two middle values.
inline double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// All zero for an empty series. Percentiles by the nearest rank.
inline ErrorSummary summarise(std::vector<double> errors) {
    if (errors.empty()) {
        return {};
    }
    std::sort(errors.begin(), errors.end());
    double squares = 0;
    for (const double error : errors) {
        squares += error * error;
    }
    const auto rank = [&](double share) {
        const auto n = static_cast<std::size_t>(std::ceil(share * static_cast<double>(errors.size())));
        return errors[n == 0 ? 0 : n - 1];
    };
    return {std::sqrt(squares / static_cast<double>(errors.size())), rank(0.5), rank(0.95), errors.back()};
}

}  // namespace tricoil::host
