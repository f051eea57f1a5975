// Reads couplings without poses, recorded without a stage.
#pragma once

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "board/support/coupling_text.hpp"
#include "board/support/distinct_files.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Couplings of every row; see CouplingColumns. Throws InputError, naming file and line, also for a table without rows.
std::vector<CouplingFrame> read_frames(Table& table, const ChannelWiring& wiring = {});

/// The couplings in phase. Frame: CouplingFrame, or derived from it.
template <typename Frame>
std::vector<Mat3<double>> in_phase_of(const std::vector<Frame>& frames) {
    std::vector<Mat3<double>> x;
    std::ranges::transform(frames, std::back_inserter(x), &Frame::x);
    return x;
}

/// Interpolates the columns of each column frame to the time of the middle column (cubic, four column frames). The column of
/// channel j of the source was measured j * skew frame periods after that of channel 0; column frames have a constant period. The
/// first two and the last two column frames are lost, and all quadratures and levels.
std::vector<CouplingFrame> deskewed(const std::vector<CouplingFrame>& frames, double skew, const CoilOrder& source = {});

/// Couplings of a sensor on a node of a printed grid, in any attitude.
struct GridFrame : CouplingFrame {
    Vec3<double> node;     // column, row, level: whole steps
    std::string place;     // path and line
    std::size_t file = 0;  // from 0: the sensor is held in the same way within a file
};

/// Numbers of columns, rows and levels of a grid.
using GridSize = std::array<int, 3>;

/// Table with column, row, level and CouplingColumns, or the rests of a
/// recording (tricoil convert --to rests) at the nodes of a grid of `size`: in the order of columns, then rows, then levels,
/// equally many rests at each node. Throws InputError, naming file and line.
std::vector<GridFrame> read_grid(const std::string& path, const std::optional<GridSize>& size = std::nullopt,
                                 const ChannelWiring& wiring = {});

/// Column frames of all files, with the numbers of their files.
std::vector<GridFrame> read_grids(const std::vector<std::string>& paths, const std::optional<GridSize>& size,
                                  const ChannelWiring& wiring = {});

/// Rows of all files, by a function of a path or of a Table. Throws InputError for a file that is given twice.
template <typename Read>
auto read_all(const std::vector<std::string>& paths, Read read) {
    refuse_repeated(paths);
    decltype(read(paths.front())) rows;
    for (const std::string& path : paths) {
        const auto part = read(path);
        rows.insert(rows.end(), part.begin(), part.end());
    }
    return rows;
}

}  // namespace tricoil::host
