#include "board/host/calibration/frame_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <span>

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"
#include "core/linear/quaternion.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::host {
namespace {

/// Columns of a table.
struct TableForm {
    std::size_t before = 0;              // columns before the couplings
    std::size_t couplings = kCouplings;  // columns of the couplings and of what follows them

    [[nodiscard]] std::size_t columns() const { return before + couplings; }
};

/// Throws InputError unless the header ends in all nine couplings, in order, and optionally in their quadratures and levels.
TableForm form_of(const std::string& path, std::string_view header) {
    TableForm form;
    form.couplings = take_coupling_fields(header);
    const std::size_t names = split(header, ',').size();
    refuse_if(names < kCouplings || !(header.ends_with("x11,x12,x13,x21,x22,x23,x31,x32,x33") ||
                                      header.ends_with("m11,m12,m13,m21,m22,m23,m31,m32,m33")),
              "{}:1: the header must end in x11,x12,x13,x21,x22,x23,x31,x32,x33 (xij: sensor coil i, source coil j), optionally "
              "followed by q11,...,q33 and a11,...,a33,gain_step",
              path);
    form.before = names - kCouplings;
    return form;
}

/// Numbers of every line. Checks their count and the rank of the couplings, and that there is a line.
template <typename Take>
void read_table(const std::string& path, const TableForm& form, const std::vector<std::string>& lines, Take take) {
    bool is_empty = true;
    for (std::size_t n = 1; n < lines.size(); ++n) {
        const TextPlace place{path, n + 1};
        if (lines[n].empty()) {
            continue;
        }
        const auto fields = split(lines[n], ',');
        refuse_if(fields.size() != form.columns(), "{}: {} columns; {} are needed", place, fields.size(), form.columns());
        const CouplingFrame frame = parse_couplings(std::span(fields).subspan(form.before), place);
        check_couplings(frame, place);
        take(fields, frame, place);
        is_empty = false;
    }
    refuse_if(is_empty, "{}: holds no column frames", path);
}

}  // namespace

bool holds_column_frames(const std::string& path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
        return true;
    }
    std::string header;
    std::getline(std::ifstream(path), header);
    header.erase(header.find_last_not_of(" \r") + 1);
    return header.ends_with("x33") || header.ends_with("m33") || header.ends_with("q33") || header.ends_with(kLevelColumns);
}

std::vector<CouplingFrame> read_frames(const std::string& path) {
    const auto lines = read_lines(path);
    std::vector<CouplingFrame> frames;
    read_table(path, form_of(path, lines.front()), lines,
               [&](const auto&, const CouplingFrame& frame, const TextPlace&) { frames.push_back(frame); });
    return frames;
}

std::vector<CouplingFrame> deskewed(const std::vector<CouplingFrame>& frames, double skew) {
    std::vector<CouplingFrame> result;
    for (std::size_t k = 2; k + 2 < frames.size(); ++k) {
        Mat3<double> x;
        for (int j = 0; j < 3; ++j) {
            // Unit of time: one frame. Column j of frame n was measured at n + j skew. Its value at k + skew is interpolated,
            // t = (1 - j) skew after its own time.
            const double t = (1 - j) * skew;
            const double shift = std::floor(t);
            const double s = t - shift;  // position between frames k + shift and k + shift + 1
            const auto column = [&](int offset) {
                return frames[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + static_cast<std::ptrdiff_t>(shift) +
                                                       offset)]
                    .x.col(j);
            };
            // Cubic Lagrange interpolation with nodes at -1, 0, 1 and 2.
            x.col(j) = -s * (s - 1) * (s - 2) / 6 * column(-1) + (s + 1) * (s - 1) * (s - 2) / 2 * column(0) -
                       (s + 1) * s * (s - 2) / 2 * column(1) + (s + 1) * s * (s - 1) / 6 * column(2);
        }
        result.push_back({x});
    }
    return result;
}

namespace {

std::vector<GridFrame> read_rests(const std::string& path, const std::vector<std::string>& lines, const TableForm& form,
                                  const std::optional<GridSize>& size) {
    if (!size) {
        throw InputError(
            path +
            ": contains rests of a recording; give the numbers of columns, rows and levels of the grid with --nodes C,R,L");
    }
    std::vector<GridFrame> frames;
    read_table(path, form, lines, [&](const auto&, const CouplingFrame& frame, const TextPlace& place) {
        frames.push_back({frame, Vec3<double>::Zero(), place.str()});
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

std::vector<GridFrame> read_grid(const std::string& path, const std::optional<GridSize>& size) {
    const auto lines = read_lines(path);
    const TableForm form = form_of(path, lines.front());
    if (form.before == 3 && lines.front().starts_with("rest,start_s,duration_s,")) {
        return read_rests(path, lines, form, size);
    }
    refuse_if(form.before != 3 || !lines.front().starts_with("column,row,level,"),
              "{}:1: the header must be column,row,level,x11,...,x33, optionally followed by q11,...,q33 and "
              "a11,...,a33,gain_step, or that of tricoil convert --to rests",
              path);
    std::vector<GridFrame> frames;
    read_table(path, form, lines, [&](const auto& fields, const CouplingFrame& couplings, const TextPlace& place) {
        Vec3<double> node;
        for (std::size_t k = 0; k < 3; ++k) {
            node(static_cast<Index>(k)) = parse_number(fields[k], place);
        }
        frames.push_back({couplings, node, place.str()});
    });
    return frames;
}

std::vector<GridFrame> read_grids(const std::vector<std::string>& paths, const std::optional<GridSize>& size) {
    std::size_t file = 0;
    return read_all(paths, [&](const std::string& path) {
        auto frames = read_grid(path, size);
        for (GridFrame& frame : frames) {
            frame.file = file;
        }
        ++file;
        return frames;
    });
}

}  // namespace tricoil::host
