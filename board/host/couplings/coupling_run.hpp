// Runs recorded couplings of two bands through the dual-rate estimator and writes one row for each high-band line.
#pragma once

#include <cstddef>
#include <string>

#include "board/host/couplings/band_files.hpp"
#include "board/host/couplings/dual_rate.hpp"
#include "board/support/statistics.hpp"

namespace tricoil::host {

struct CouplingSummary {
    std::size_t rows = 0;
    std::size_t valid = 0;
    std::size_t low_lines = 0;  // that the estimator accepted
    double scalar = 0;          // after the last line
    double scalar_sigma = 0;
    ErrorSummary distortion;  // m, over valid rows
    ErrorSummary position_sigma;
};

/// CSV: time_us,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad,valid,distortion_mm,low_band.
/// low_band is 1 at rows that have the time of a low-band line. Each row depends only on lines up to its own. Throws like
/// OutputFile, and Interrupted; then no file is left.
CouplingSummary run_couplings(const BandModels& models, const BandRecording& recording, const DualRateParams& params,
                              const std::string& out);

}  // namespace tricoil::host
