// Misfit that calibrated coils leave without metal.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <vector>

#include "board/host/calibration/evaluation.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Floor for the distortion test: with it, the largest misfit of the calibration's poses has the chi-square of the gate.
/// misfit_share: of the couplings, root sum squares, that the pose does not explain. |X|^2 = 3/2 k^2 by (6).
inline double misfit_floor_of(double misfit_share) {
    return std::sqrt(1.5 / tracking::CommonParams<double>{}.distortion_gate) * misfit_share;
}

/// The same for the largest of several misfits; the `outliers` largest ones are left out.
inline double misfit_floor_of(std::vector<double> shares, std::size_t outliers) {
    std::sort(shares.begin(), shares.end(), std::greater<>());
    return misfit_floor_of(shares[std::min(outliers, shares.size() - 1)]);
}

/// The same for these poses.
inline double misfit_floor_of(const std::vector<EvaluatedPose>& errors, std::size_t outliers) {
    std::vector<double> shares;
    for (const EvaluatedPose& error : errors) {
        shares.push_back(error.converged ? error.misfit_share : 0);
    }
    return misfit_floor_of(std::move(shares), outliers);
}

/// Share of the floor with which the positions of these poses, evaluated with the whole floor, have the errors that a tracker
/// states; the `outliers` largest ones are left out. The misfit lies in three other directions of the couplings, so it does not
/// show this. At least 0.3: metal below the gate of the floor must stay within 5 standard deviations.
inline double floor_share_of(const std::vector<EvaluatedPose>& errors, std::size_t outliers) {
    constexpr double kLeast = 0.3;
    constexpr int kSteps = 20;
    double share = 1;
    for (int step = 0; step < kSteps; ++step) {
        std::vector<double> squares;
        for (const EvaluatedPose& error : errors) {
            if (error.converged && error.of_floor.trace() > 0) {
                const Mat3<double> stated = share * share * error.of_floor + error.of_others;
                squares.push_back(error.error_m.dot(stated.inverse() * error.error_m));
            }
        }
        if (squares.size() <= outliers) {
            return 1;
        }
        std::sort(squares.begin(), squares.end());
        squares.resize(squares.size() - outliers);
        const double nees = std::accumulate(squares.begin(), squares.end(), 0.0) / (3 * static_cast<double>(squares.size()));
        share = std::clamp(share * std::sqrt(nees), kLeast, calibration::CoilErrors<double>::kMostOfFloor);
    }
    return share;
}

}  // namespace tricoil::host
