#include "sim/world/metal/plate_modes.hpp"

#include <array>
#include <cmath>
#include <functional>

#include "sim/dense_algebra.hpp"

namespace tricoil::sim {
namespace {

/// Symmetric interaction of two cells by their column and row numbers.
using Interaction = std::function<double(int, int, int, int)>;

/// Mean of 1 / distance between the points of two equal rectangles in one plane, `x`, `y` apart. The integral over both is the
/// second difference, along x and along y, of the fourth integral of 1 / r (Hoer and Love, J. Res. NBS 69C, 1965, for tapes).
double mean_inverse_distance(double x, double y, double width, double height) {
    const auto integral = [](double u, double v) {
        const double first = u == 0 ? 0 : u * u * v / 2 * std::asinh(v / std::abs(u));
        const double second = v == 0 ? 0 : v * v * u / 2 * std::asinh(u / std::abs(v));
        return first + second - std::pow(std::hypot(u, v), 3) / 6;
    };
    const auto along_y = [&](double u) { return integral(u, y + height) - 2 * integral(u, y) + integral(u, y - height); };
    const double area = width * height;
    return (along_y(x + width) - 2 * along_y(x) + along_y(x - width)) / (area * area);
}

PlateGrid make_grid(double cell_x, double cell_y, int count) {
    PlateGrid grid;
    grid.cell_x_m = cell_x;
    grid.cell_y_m = cell_y;
    grid.centres_m.resize(count * count, 2);
    for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) {
            grid.centres_m.row(i * count + j) << (i - (count - 1) / 2.0) * cell_x, (j - (count - 1) / 2.0) * cell_y;
        }
    }
    return grid;
}

/// Matrix of an interaction between vectors of one parity: even or odd under reflection in x and in y. Entries: cells of one
/// quarter of the plate.
Eigen::MatrixXd quarter(const Interaction& interaction, int count, double parity_x, double parity_y) {
    const int half = count / 2;
    Eigen::MatrixXd matrix(half * half, half * half);
    for (int row = 0; row < half * half; ++row) {
        const int i = row / half;
        const int j = row % half;
        for (int column = 0; column <= row; ++column) {
            const int k = column / half;
            const int l = column % half;
            const int k_mirror = count - 1 - k;
            const int l_mirror = count - 1 - l;
            const double value = interaction(i, j, k, l) + parity_x * interaction(i, j, k_mirror, l) +
                                 parity_y * interaction(i, j, k, l_mirror) +
                                 parity_x * parity_y * interaction(i, j, k_mirror, l_mirror);
            matrix(row, column) = matrix(column, row) = value;
        }
    }
    return matrix;
}

/// Modes of all parities. `solve` returns, for the two interactions of a parity, values and vectors with v^T B v = 1.
PlateModes all_modes(const Interaction& a, const Interaction& b, int count, decltype(eigen_of_pair)& solve) {
    const int half = count / 2;
    const Eigen::Index part = half * half;
    PlateModes modes{Eigen::MatrixXd(count * count, count * count), Eigen::VectorXd(count * count)};
    Eigen::Index first = 0;
    for (const auto& [x, y] : {std::array{1.0, 1.0}, std::array{1.0, -1.0}, std::array{-1.0, 1.0}, std::array{-1.0, -1.0}}) {
        const auto [values, vectors] = solve(quarter(a, count, x, y), quarter(b, count, x, y));
        modes.values.segment(first, part) = values;
        for (Eigen::Index cell = 0; cell < part; ++cell) {
            const int i = static_cast<int>(cell) / half;
            const int j = static_cast<int>(cell) % half;
            const Eigen::RowVectorXd share = vectors.row(cell) / 2;  // four equal cells: the whole vector has norm 1 again
            modes.vectors.block(i * count + j, first, 1, part) = share;
            modes.vectors.block((count - 1 - i) * count + j, first, 1, part) = x * share;
            modes.vectors.block(i * count + count - 1 - j, first, 1, part) = y * share;
            modes.vectors.block((count - 1 - i) * count + count - 1 - j, first, 1, part) = x * y * share;
        }
        first += part;
    }
    return modes;
}

/// Table of `value` for distances of 0 to `count` cells along both axes.
Eigen::MatrixXd tabulate(int count, const std::function<double(int, int)>& value) {
    Eigen::MatrixXd table(count + 1, count + 1);
    for (int i = 0; i <= count; ++i) {
        for (int j = 0; j <= count; ++j) {
            table(i, j) = value(i, j);
        }
    }
    return table;
}

/// Second difference across strips: a loop is two opposite currents, one cell apart.
double of_loops(const Eigen::MatrixXd& strips, int along, int across) {
    const auto at = [&](int n) { return strips(std::abs(along), std::abs(n)); };
    return 2 * at(across) - at(across + 1) - at(across - 1);
}

}  // namespace

CurrentModes::CurrentModes(double width_m, double height_m, int count) {
    // Strips of the width of a cell tile the plate; the loops run along their centre lines.
    const double dx = width_m / (count + 1);
    const double dy = height_m / (count + 1);
    grid = make_grid(dx, dy, count);
    const auto strip = [&](double length, int x, int y) {  // mutual inductance times 4 pi / mu0
        return length * length * mean_inverse_distance(x * dx, y * dy, dx, dy);
    };
    const Eigen::MatrixXd along_x = tabulate(count, [&](int x, int y) { return strip(dx, x, y); });
    const Eigen::MatrixXd along_y = tabulate(count, [&](int y, int x) { return strip(dy, x, y); });
    const Interaction inductance = [&](int i, int j, int k, int l) {
        return of_loops(along_x, i - k, j - l) + of_loops(along_y, j - l, i - k);
    };
    const Interaction resistance = [&](int i, int j, int k, int l) {
        const int x = std::abs(i - k);
        const int y = std::abs(j - l);
        const double squares_x = dx / dy;  // of a strip along x
        const double squares_y = dy / dx;
        return x + y == 0 ? 2 * (squares_x + squares_y) : x + y > 1 ? 0.0 : y == 1 ? -squares_x : -squares_y;
    };
    modes = all_modes(resistance, inductance, count, eigen_of_pair);
    modes.values = modes.values.cwiseInverse().eval();
}

PoleModes::PoleModes(double width_m, double height_m, int count) {
    const double dx = width_m / count;
    const double dy = height_m / count;
    grid = make_grid(dx, dy, count);
    const Eigen::MatrixXd table = tabulate(count, [&](int x, int y) { return mean_inverse_distance(x * dx, y * dy, dx, dy); });
    const Interaction potential = [&](int i, int j, int k, int l) { return table(std::abs(i - k), std::abs(j - l)); };
    const double link_x = dy / dx;  // width over length
    const double link_y = dx / dy;
    const Interaction links = [&](int i, int j, int k, int l) {
        const int x = std::abs(i - k);
        const int y = std::abs(j - l);
        if (x + y > 0) {
            return x + y > 1 ? 0.0 : x == 1 ? -link_x : -link_y;
        }
        const int sides_x = (i > 0 ? 1 : 0) + (i + 1 < count ? 1 : 0);
        const int sides_y = (j > 0 ? 1 : 0) + (j + 1 < count ? 1 : 0);
        return sides_x * link_x + sides_y * link_y;
    };
    modes = all_modes(links, potential, count, eigen_of_product);
}

}  // namespace tricoil::sim
