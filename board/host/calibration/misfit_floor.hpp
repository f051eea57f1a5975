// Misfit that calibrated coils leave without metal.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
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

}  // namespace tricoil::host
