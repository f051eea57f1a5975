#include "board/host/calibration/frame_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

/// Takes the couplings of every row; refuses a table without rows.
template <typename Take>
void read_rows(Table& table, const ChannelWiring& wiring, Take take) {
    const CouplingColumns couplings(table, wiring);
    bool is_empty = true;
    for (; table.next(); is_empty = false) {
        CouplingFrame frame = couplings.read();
        frame.rewire(wiring);
        take(frame);
    }
    refuse_if(is_empty, "{}: holds no column frames", table.path());
}

}  // namespace

std::vector<CouplingFrame> read_frames(Table& table, const ChannelWiring& wiring) {
    std::vector<CouplingFrame> frames;
    read_rows(table, wiring, [&](const CouplingFrame& frame) { frames.push_back(frame); });
    return frames;
}

std::vector<CouplingFrame> deskewed(const std::vector<CouplingFrame>& frames, double skew, const CoilOrder& source) {
    std::vector<CouplingFrame> result;
    for (std::size_t k = 2; k + 2 < frames.size(); ++k) {
        Mat3<double> x;
        for (int j = 0; j < 3; ++j) {
            const int coil = source.coil[static_cast<std::size_t>(j)];
            // Unit of time: one frame. Column j of frame n was measured at n + j skew. Its value at k + skew is interpolated,
            // t = (1 - j) skew after its own time.
            const double t = (1 - j) * skew;
            const double shift = std::floor(t);
            const double s = t - shift;  // position between frames k + shift and k + shift + 1
            const auto column = [&](int offset) {
                return frames[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + static_cast<std::ptrdiff_t>(shift) +
                                                       offset)]
                    .x.col(coil);
            };
            // Cubic Lagrange interpolation with nodes at -1, 0, 1 and 2.
            x.col(coil) = -s * (s - 1) * (s - 2) / 6 * column(-1) + (s + 1) * (s - 1) * (s - 2) / 2 * column(0) -
                          (s + 1) * s * (s - 2) / 2 * column(1) + (s + 1) * s * (s - 1) / 6 * column(2);
        }
        result.push_back({x});
    }
    return result;
}

namespace {

std::vector<GridFrame> read_rests(Table& table, const std::optional<GridSize>& size, const ChannelWiring& wiring) {
    const std::string& path = table.path();
    refuse_if(!size,
              "{}: contains rests of a recording; give the numbers of columns, rows and levels of the grid with --nodes C,R,L",
              path);
    std::vector<GridFrame> frames;
    read_rows(table, wiring, [&](const CouplingFrame& frame) {
        frames.push_back({frame, Vec3<double>::Zero(), table.place().str()});
    });
    const auto [columns, rows, levels] = *size;
    const auto nodes = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * static_cast<std::size_t>(levels);
    refuse_if(frames.empty() || frames.size() % nodes != 0,
              "{}: {} rests do not fit {} nodes; every node needs the same number of rests of 0.5 s or more", path, frames.size(),
              nodes);
    const std::size_t rests = frames.size() / nodes;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const auto node = static_cast<int>(k / rests);
        const Vec3<int> place(node % columns, node / columns % rows, node / (columns * rows));
        frames[k].node = place.cast<double>();
    }
    return frames;
}

}  // namespace

std::vector<GridFrame> read_grid(const std::string& path, const std::optional<GridSize>& size, const ChannelWiring& wiring) {
    Table table(path);
    if (table.has("rest")) {
        return read_rests(table, size, wiring);
    }
    std::array<std::size_t, 3> node;
    std::ranges::transform(std::array{"column", "row", "level"}, node.begin(), [&](const char* name) {
        return table.column(name,
                            "column,row,level,x11,...,x33, optionally q11,...,q33 and a11,...,a33,gain_step, or be that of "
                            "tricoil convert --to rests");
    });
    std::vector<GridFrame> frames;
    read_rows(table, wiring, [&](const CouplingFrame& couplings) {
        const auto at = [&](std::size_t k) { return table.number(node[k]); };
        frames.push_back({couplings, Vec3<double>(at(0), at(1), at(2)), table.place().str()});
    });
    return frames;
}

std::vector<GridFrame> read_grids(const std::vector<std::string>& paths, const std::optional<GridSize>& size,
                                  const ChannelWiring& wiring) {
    std::size_t file = 0;
    return read_all(paths, [&](const std::string& path) {
        auto frames = read_grid(path, size, wiring);
        for (GridFrame& frame : frames) {
            frame.file = file;
        }
        ++file;
        return frames;
    });
}

}  // namespace tricoil::host
