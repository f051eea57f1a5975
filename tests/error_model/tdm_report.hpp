// Measured and predicted errors of a simulation with TDM: RMS, and correlation of their components.
#pragma once

#include <cmath>
#include <vector>

#include "tests/error_model/tdm_experiment.hpp"

namespace tricoil::paper {

struct ErrorPart {
    double measured_rms = 0;
    double predicted_rms = 0;
    double device_rms = 0;   // predicted from the device's own poses
    double correlation = 0;  // of measured and predicted
};

/// first: 0 for the position (m), 3 for the rotation (rad).
inline ErrorPart summarise(const std::vector<TdmPose>& poses, Index first) {
    double m = 0, p = 0, mm = 0, pp = 0, dd = 0, mp = 0;
    for (const TdmPose& pose : poses) {
        for (Index i = first; i < first + 3; ++i) {
            m += pose.measured(i);
            p += pose.predicted(i);
            mm += pose.measured(i) * pose.measured(i);
            pp += pose.predicted(i) * pose.predicted(i);
            dd += pose.predicted_by_device(i) * pose.predicted_by_device(i);
            mp += pose.measured(i) * pose.predicted(i);
        }
    }
    const auto count = static_cast<double>(poses.size());
    const double covariance = mp - m * p / (3 * count);
    const double variances = (mm - m * m / (3 * count)) * (pp - p * p / (3 * count));
    return {std::sqrt(mm / count), std::sqrt(pp / count), std::sqrt(dd / count), covariance / std::sqrt(variances)};
}

}  // namespace tricoil::paper
