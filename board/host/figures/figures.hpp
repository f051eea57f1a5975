// Figures. Each function writes CSV files to a folder and returns the pictures to draw from them. After a signal each throws
// Interrupted between two simulations.
#pragma once

#include <filesystem>
#include <vector>

#include "board/host/figures/gnuplot.hpp"
#include "board/support/interrupt.hpp"

namespace tricoil::host {

/// Figs. 1 to 6 in the paper's arrangement: open loop, measured solid red (Fig. 6 blue), calculated dash-dotted black.
std::vector<Picture> paper_figures(const std::filesystem::path& folder, const InterruptGuard& guard);

/// Comparison of closed loop and open loop, examples I, II and III.
Picture loop_figure(const std::filesystem::path& folder, const InterruptGuard& guard);

/// Comparison of error budget and simulation, TDM at 240 Hz. recordings: folder of .traj files; empty: generated hand motions.
/// progress: called for every motion. Throws InputError if the folder contains no trajectory.
Picture budget_figure(const std::filesystem::path& folder, const std::filesystem::path& recordings, const InterruptGuard& guard,
                      const ShowShare& progress);

/// Metal near the coils: response of a sphere by frequency, position error by distance, position error and distortion figure.
Picture metal_figure(const std::filesystem::path& folder, const InterruptGuard& guard);

}  // namespace tricoil::host
