// Data of figures. Each function writes CSV files to a folder, from which _draw.py draws. After a signal each throws Interrupted
// between two simulations.
#pragma once

#include <filesystem>

#include "board/support/interrupt.hpp"
#include "board/support/progress.hpp"

namespace tricoil::host {

/// Figs. 1 to 6 of the paper, and the comparison of closed loop and open loop, examples I, II and III.
void write_paper_figures(const std::filesystem::path& folder, const InterruptGuard& guard);

/// Comparison of error budget and simulation, TDM at 240 Hz. recordings: folder of .traj files; empty: generated hand motions.
/// progress: called for every motion. Throws InputError if the folder contains no trajectory.
void write_budget_figure(const std::filesystem::path& folder, const std::filesystem::path& recordings,
                         const InterruptGuard& guard, const ShowShare& progress);

/// Metal near the coils: response of a sphere by frequency, position error by distance, position error and distortion figure.
void write_metal_figure(const std::filesystem::path& folder, const InterruptGuard& guard);

}  // namespace tricoil::host
